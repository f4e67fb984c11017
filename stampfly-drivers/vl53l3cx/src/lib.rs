#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(test)]
extern crate std;

pub mod bins;
mod boot;
pub mod codec;
mod config;
mod histogram;
mod preset;
mod trial;
mod xshut;

pub use boot::BootAddress;
use codec::{RESULT_BYTES, register};
pub use codec::{RangeStatus, Reading};
pub use config::{Config, DistanceMode, Ranging};
use embedded_hal::i2c::{Error, ErrorKind};
use embedded_hal_async::i2c::I2c;
#[cfg(feature = "embassy-time")]
pub use stampfly_driver_core::EmbassyClock;
use stampfly_driver_core::chip::Port;
pub use stampfly_driver_core::chip::{ChipError, I2cRegisters, TransferLimit};
pub use stampfly_driver_core::{RangeFinder, Sample, Timebase};
pub use stampfly_driver_core::{SensorError, SensorErrorKind, blocking, embedded_hal, embedded_hal_async};
pub use stampfly_types::messages::TofData;
pub use stampfly_types::{Duration, Instant};

use preset::Session;
pub use trial::Implausible;
use trial::{Trial, Verdict};
pub use xshut::{NoXshut, Xshut};

/// In reset. The data sheet gives no shortest time.
const RESET: Duration = Duration::from_millis(1);
/// In reset by the register: 100 µs in public drivers of the VL53L1X.
const SOFT_RESET: Duration = Duration::from_micros(100);
/// From reset to the first access; 1.2 ms at most (§ "Power sequence").
const BOOT: Duration = Duration::from_millis(4);
/// How long the firmware may take to start.
const BOOT_LIMIT: Duration = Duration::from_millis(100);
/// How long to wait for the neighbour that is waking up: a little longer than that may take.
const NEIGHBOUR_LIMIT: Duration = Duration::from_millis(200);
/// The chip's clock may be off by one part in this many.
const DRIFT: u64 = 32;
/// After so many periods half of one may have drifted away: the rhythm is not known any more.
const IN_RHYTHM: u64 = DRIFT / 2;
/// A result that has been seen before is taken back and waited out so often.
const REPETITIONS: usize = 2;
/// How often the interrupt is looked at once it may be up.
const POLL: Duration = Duration::from_millis(2);
/// How often the number of the measurement has to advance in the self test.
const ADVANCES: usize = 2;

/// The driver. Implements [`RangeFinder`].
///
/// `Sample::at` is the middle of the measurement, good to the 2 ms between two looks at the chip.
///
/// # Two ways
/// [`Config::ranging`] says whether the chip computes the distance or the driver does, from a histogram. In [`Ranging::Automatic`] a call ends once with
/// [`ChipError::Implausible`] when the driver changes over, and with [`ChipError::SelfTest`] if it changes back because neither way measures
/// anything; the next call starts the chip again.
///
/// A sample is vouched for (`valid`) when the chip calls it [`RangeStatus::Valid`] and it is above zero and within the
/// mode's reach. The first one after a start is not: the chip tells a target beyond its reach from one within by
/// comparing measurements. `status` is [`RangeStatus::number`]; [`reading`](Self::reading) has everything it said.
///
/// # Several on a bus
/// Every chip wakes up at 0x29, so each has a pin on its XSHUT and is given an address of its own. Creating a driver
/// puts its chip into reset: create all of them, with one [`BootAddress`] between them, before the first is used. From
/// then on they start and restart in any order and in separate tasks. A chip that lost its power is back at 0x29 and
/// no longer answers: the driver says [`ChipError::Restarted`], and its next call resets that chip, and that one only,
/// and moves it. When both are back at 0x29 the first one to call waits in reset ([`ChipError::AddressTaken`]) until
/// the other has moved.
///
/// XSHUT rises only when nothing is on the bus, as the chip wants it: right after a transfer of the driver's own. That holds where all who share
/// the bus are tasks of one executor. Where they are not, give it an [`Xshut`] of your own that keeps the others off the bus meanwhile.
///
/// A lone chip may stay: [`BOOT_ADDRESS`](Vl53l3cx::BOOT_ADDRESS) as its address.
///
/// # Without a pin
/// [`NoXshut`] instead of one. The chip is looked for at its address, where somebody may have put it, and then at 0x29; it is reset by a
/// register and looked for again. One such chip may share a bus with others that have pins: start it before them, at an address of its own. Two
/// without a pin may as well, if somebody else has moved them apart. A start takes 4 ms longer, for a chip that has its power since just now.
///
/// # Times
/// The first sample takes 10 ms and two measurements, 80 ms in all. `next` ends within two periods and 20 ms
/// ([`ChipError::NoSample`]), one period later for each of up to two results that it has seen before; when it has to start the chip, within four more periods and 350 ms.
/// From histograms the first sample takes 100 ms, and each one after it the budget and 4 to 6 ms.
///
/// ```
/// # use stampfly_driver_fakes::memory::{Chip, Clock, Pin};
/// # let result = [9, 0, 1, 16, 0, 0, 0, 0, 9, 0, 8, 0, 0, 0x04, 0xD2, 0, 90];
/// # let content: [(u16, &[u8]); 5] =
/// #     [(0x89, &result), (0xE5, &[1]), (0xDE, &[3, 232]), (0x10F, &[0xEA, 0xAA]), (0x30, &[1, 1])];
/// # let [below_bus, ahead_bus] = [Chip::new(&content), Chip::new(&content)];
/// # let [below_pin, ahead_pin] = [&below_bus, &ahead_bus].map(|chip| Pin(chip.awake.clone()));
/// # let clock = Clock::default();
/// use stampfly_vl53l3cx::{BootAddress, Config, RangeFinder, Vl53l3cx, blocking::block_on};
///
/// // Two handles of one bus; on every chip's XSHUT a pin.
/// let boot = BootAddress::new();
/// let mut below = Vl53l3cx::new(below_bus, below_pin, &boot, 0x30, clock.clone(), Config::default());
/// let mut ahead = Vl53l3cx::new(ahead_bus, ahead_pin, &boot, 0x31, clock, Config::default());
///
/// assert!(!block_on(below.next()).expect("a measurement").data.valid, "the first one is not vouched for");
/// let sample = block_on(below.next()).expect("a measurement");
/// assert!(sample.data.valid && sample.data.distance == 1.234, "metres");
/// assert!(block_on(ahead.next()).is_ok());
/// ```
#[derive(Debug)]
pub struct Vl53l3cx<'b, I, X, T> {
    port: Port<I2cRegisters<I>, T>,
    xshut: X,
    boot: &'b BootAddress,
    address: u8,
    config: Config,
    ranging: bool,
    /// The interrupt was up and has not been taken back for sure: what it stands for is old.
    stale: bool,
    /// No measurement since the start.
    first: bool,
    /// When the next measurement may be there.
    due: Instant,
    /// The newest result since the start, as it came.
    block: Option<[u8; RESULT_BYTES]>,
    reading: Option<Reading>,
    /// The histogram's rhythm, where that is measured since the start.
    session: Option<Session>,
    /// Whether a histogram is to be measured.
    histogram: bool,
    /// As long as it is not settled which way to measure.
    trial: Option<Trial>,
    doubt: Option<Implausible>,
}

impl Vl53l3cx<'_, (), (), ()> {
    /// The address after every start.
    pub const BOOT_ADDRESS: u8 = codec::BOOT_ADDRESS;
}

impl<'b, I: I2c, X: Xshut, T: Timebase> Vl53l3cx<'b, I, X, T> {
    /// A driver of the chip on this pin, which it puts into reset, to be moved to this address; without a pin [`NoXshut`].
    pub fn new(bus: I, mut xshut: X, boot: &'b BootAddress, address: u8, clock: T, config: Config) -> Self {
        // A pin that refuses is reported by the first start.
        let _ = xshut.hold();
        let port = Port::new(I2cRegisters::new(bus, address), clock, TransferLimit::I2C);
        Self {
            port,
            xshut,
            boot,
            address,
            config,
            ranging: false,
            stale: false,
            first: true,
            due: Instant::ZERO,
            block: None,
            reading: None,
            session: None,
            histogram: config.ranging == Ranging::Histogram,
            trial: match config.ranging {
                Ranging::Automatic { target } => Some(Trial::new(target)),
                Ranging::Light | Ranging::Histogram => None,
            },
            doubt: None,
        }
    }

    stampfly_driver_core::transfer_limit!();

    /// Takes the driver apart: the bus, the pin and the clock. The chip goes on measuring at its address.
    pub fn release(self) -> (I, X, T) {
        let (bus, clock) = self.port.release();
        (bus, self.xshut, clock)
    }

    /// The newest measurement, all of it; `None` before the first.
    #[must_use]
    pub const fn reading(&self) -> Option<Reading> {
        self.reading
    }

    /// Which way it measures: [`Ranging::Light`] or [`Ranging::Histogram`].
    #[must_use]
    pub const fn ranging(&self) -> Ranging {
        if self.histogram { Ranging::Histogram } else { Ranging::Light }
    }

    /// Why the light mode's results could not be right, in [`Ranging::Automatic`]; `None` as long as they could.
    #[must_use]
    pub const fn doubt(&self) -> Option<Implausible> {
        self.doubt
    }

    /// Sets the chip up: reset, identification, address, configuration, a first measurement that is thrown away.
    ///
    /// # Errors
    /// Another chip, an impossible configuration, the boot address in use, the bus.
    pub async fn start(&mut self) -> Result<(), ChipError<I::Error>> {
        self.ranging = false;
        if !codec::is_possible(&self.config) {
            return Err(ChipError::InvalidConfiguration);
        }
        self.session = None;
        self.wake().await?;
        self.stale = false;
        self.first = true;
        self.block = None;
        if self.histogram {
            self.start_histogram().await?;
            self.ranging = true;
            return Ok(());
        }
        self.configure().await?;
        // The first measurement finds the detector's bias; those after it only follow its drift.
        self.port.write(register::SYSTEM_MODE_START, &[codec::RANGING]).await?;
        self.due = self.port.now() + self.config.budget;
        self.ready().await?;
        self.port.write(register::SYSTEM_INTERRUPT_CLEAR, &[codec::CLEAR]).await?;
        self.port.write(register::SYSTEM_MODE_START, &[codec::STANDBY]).await?;
        self.port.write(register::VHV_CONFIG_TIMEOUT_MACROP_LOOP_BOUND, &[codec::SHORT_BIAS_SEARCH]).await?;
        self.port.write(register::VHV_CONFIG_INIT, &[codec::FROM_LAST_BIAS]).await?;
        self.port.write(register::SYSTEM_MODE_START, &[codec::RANGING]).await?;
        self.due = self.port.now() + early(self.config.budget);
        self.ranging = true;
        Ok(())
    }

    /// Resets and sets the chip up, has it keep its times and limits and measure three times. 0.15 s by default; within 21 periods
    /// and one second, however slow the bus, with [`TransferLimit::I2C_SENSORS`].
    ///
    /// The chip's own tests of laser and detector come with every measurement: this one asks whether they passed and whether
    /// measurements go on. No target is a pass, so a laser that the chip believes in but somebody covered is not found.
    /// Afterwards the chip measures, and the next sample is the next measurement. Neighbours notice nothing.
    ///
    /// # Errors
    /// Those of [`start`](Self::start), among them [`ChipError::Configuration`] for firmware that does not start and
    /// times that are not kept; [`ChipError::NoSample`] when measurements end or are not numbered on;
    /// [`ChipError::Data`] when nobody drives the bus; [`ChipError::SelfTest`] when the chip says that its laser or
    /// detector failed, that it could not compute, or something that is no status.
    pub async fn self_test(&mut self) -> Result<(), ChipError<I::Error>> {
        self.start().await?;
        // The first one after a start is not a measurement of anything: only its number counts.
        let mut before = self.measurement().await?.1.count;
        self.first = false;
        for _ in 0..ADVANCES {
            let (_, reading) = self.measurement().await?;
            if !reading.status().is_measurement() {
                return Err(ChipError::SelfTest);
            }
            if core::mem::replace(&mut before, reading.count) == reading.count {
                self.ranging = false;
                return Err(ChipError::NoSample);
            }
        }
        Ok(())
    }

    /// The next result, taken apart, and when it was there.
    async fn measurement(&mut self) -> Result<(Instant, Reading), ChipError<I::Error>> {
        if self.histogram {
            return self.histogram().await;
        }
        let (seen, block) = self.result().await?;
        Ok((seen, Reading::decode(&block).ok_or(ChipError::Data)?))
    }

    /// Starts if it has to, and takes the next measurement.
    async fn started_measurement(&mut self) -> Result<(Instant, Reading), ChipError<I::Error>> {
        if !self.ranging {
            self.start().await?;
        }
        self.measurement().await
    }

    /// Takes note of a result as long as it is not settled which way to measure, and settles it.
    fn try_out(
        &mut self,
        outcome: &Result<(Instant, Reading), ChipError<I::Error>>,
    ) -> Result<(), ChipError<I::Error>> {
        let now = self.port.now();
        let result = match outcome {
            // Not a measurement of anything.
            Ok(_) if self.first => return Ok(()),
            Ok((_, reading)) => Some(*reading),
            Err(ChipError::NoSample) => None,
            // Whatever this is, the other way would not mend it.
            Err(_) => return Ok(()),
        };
        let Some(verdict) = self.trial.as_mut().and_then(|trial| trial.note(now, result)) else { return Ok(()) };
        self.trial = None;
        let Verdict::Implausible(reason) = verdict else { return Ok(()) };
        self.histogram = !self.histogram;
        self.ranging = false;
        if self.histogram {
            self.doubt = Some(reason);
            self.trial = Some(Trial::new(true));
            Err(ChipError::Implausible)
        } else {
            // Where it sees nothing either there is no reason to prefer it.
            Err(ChipError::SelfTest)
        }
    }

    /// From whatever state to the firmware running at the chip's own address.
    async fn wake(&mut self) -> Result<(), ChipError<I::Error>> {
        let Self { port, xshut, boot, address, .. } = self;
        // Before anything else: a chip that came back by itself must not stand in its neighbour's way.
        xshut.hold().map_err(|_| ChipError::Pin)?;
        let deadline = port.now() + NEIGHBOUR_LIMIT;
        while boot.is_taken() {
            if port.now() > deadline {
                return Err(ChipError::AddressTaken);
            }
            port.wait(RESET).await;
            port.check_clock()?;
        }
        let mut waking = boot.take(xshut).ok_or(ChipError::AddressTaken)?;
        // Where the chip may be when it has started.
        let mut places = [codec::BOOT_ADDRESS; 2];
        if X::WIRED {
            port.move_to(codec::BOOT_ADDRESS);
            port.wait(RESET).await;
            if answers(port).await? {
                return Err(ChipError::AddressTaken);
            }
            // Not while anything is on the bus (DS13204, "Power sequence"). A transfer of ours has just ended, and before this task waits
            // again nobody else of its executor begins one: so nothing may come in between.
            waking.release().map_err(|_| ChipError::Pin)?;
        } else {
            // It may have its power since just now.
            port.wait(BOOT).await;
            reset_by_register(port, *address).await?;
            places = [*address, codec::BOOT_ADDRESS];
        }
        port.wait(BOOT).await;
        let deadline = port.now() + BOOT_LIMIT;
        loop {
            let [place, other] = places;
            port.move_to(place);
            // A chip that has not started does not answer.
            let looks = port.now();
            match port.read(register::FIRMWARE_SYSTEM_STATUS).await {
                Ok([status]) if status & 1 != 0 => break,
                Ok([status]) if looks > deadline => return Err(ChipError::Configuration { status }),
                Err(error @ ChipError::ClockStopped) => return Err(error),
                Err(error) if looks > deadline => return Err(error),
                Ok(_) => {}
                Err(_) => places = [other, place],
            }
            port.wait(RESET).await;
        }
        let [model, module] = identification(port).await?;
        if !codec::MODELS.contains(&model) || module != codec::MODULE_TYPE {
            return Err(ChipError::Identification { found: u16::from_be_bytes([model, module]) });
        }
        port.write(register::I2C_SLAVE_DEVICE_ADDRESS, &[*address]).await?;
        port.move_to(*address);
        identification(port).await?;
        waking.moved();
        Ok(())
    }

    /// The furthest distance that is vouched for, m.
    const fn reach(&self) -> f32 {
        if self.histogram { bins::REACH } else { self.config.mode.reach() }
    }

    async fn configure(&mut self) -> Result<(), ChipError<I::Error>> {
        for (register, values) in codec::FIXED {
            self.port.write(register, values).await?;
        }
        let offset = codec::range_offset(self.port.read_twice(register::MM_CONFIG_OUTER_OFFSET_MM).await?);
        self.port.write(register::ALGO_PART_TO_PART_RANGE_OFFSET_MM, &offset).await?;
        let kept: [u8; 2] = self.port.read(register::ALGO_PART_TO_PART_RANGE_OFFSET_MM).await?;
        if !codec::is_offset_kept(offset, kept) {
            return Err(ChipError::Configuration { status: kept[1] });
        }
        let mode = self.config.mode;
        self.port.write(register::PHASECAL_CONFIG_TIMEOUT_MACROP, &[codec::phase_calibration(mode)]).await?;
        let ranging = codec::ranging(&self.config);
        self.port.write(register::RANGE_CONFIG_TIMEOUT_MACROP_A, &ranging).await?;
        // A wrong bit in here would not be noticed as anything but wrong distances.
        let kept: [u8; 12] = self.port.read(register::RANGE_CONFIG_TIMEOUT_MACROP_A).await?;
        if kept != ranging {
            return Err(ChipError::Configuration { status: kept[2] });
        }
        self.port.write(register::SD_CONFIG_WOI_SD0, &mode.windows()).await?;
        let oscillator = u16::from_be_bytes(self.port.read_twice(register::RESULT_OSC_CALIBRATE_VAL).await?);
        let period = codec::inter_measurement(self.config.period, oscillator);
        self.port.write(register::SYSTEM_INTERMEASUREMENT_PERIOD, &period).await
    }

    /// Reads where a chip that runs has to answer: when it refuses twice, it is not there any more.
    async fn read<const N: usize>(&mut self, register: u16) -> Result<[u8; N], ChipError<I::Error>> {
        let absent = |error: &I::Error| matches!(error.kind(), ErrorKind::NoAcknowledge(_));
        match self.port.read(register).await {
            Err(ChipError::Bus(error)) if absent(&error) => {}
            other => return other,
        }
        match self.port.read(register).await {
            Err(ChipError::Bus(error)) if absent(&error) => {
                self.ranging = false;
                Err(ChipError::Restarted)
            }
            other => other,
        }
    }

    /// Waits for a result that has not been there before, and takes its interrupt back.
    async fn result(&mut self) -> Result<(Instant, [u8; RESULT_BYTES]), ChipError<I::Error>> {
        for _ in 0..=REPETITIONS {
            let seen = self.ready().await?;
            // Until the interrupt has been taken back, what follows may be this measurement again.
            self.stale = true;
            let block: [u8; RESULT_BYTES] = self.read(register::RESULT_RANGE_STATUS).await?;
            self.port.write(register::SYSTEM_INTERRUPT_CLEAR, &[codec::CLEAR]).await?;
            self.stale = false;
            // The chip numbers its results: the same one again means that it did not understand the last clear.
            if self.block.replace(block) != Some(block) {
                return Ok((seen, block));
            }
        }
        self.ranging = false;
        Err(ChipError::NoSample)
    }

    /// Is the interrupt up? Notices a chip that came back with other settings.
    async fn look(&mut self) -> Result<bool, ChipError<I::Error>> {
        let [mut control, mut status] = self.read(register::GPIO_HV_MUX_CTRL).await?;
        if control != codec::ACTIVE_HIGH {
            // Twice, before a wrong bit on the bus costs a start.
            [control, status] = self.read(register::GPIO_HV_MUX_CTRL).await?;
        }
        if control != codec::ACTIVE_HIGH {
            self.ranging = false;
            return Err(ChipError::Restarted);
        }
        Ok(status & 1 != 0)
    }

    /// Waits for a new measurement, and gives the instant it was there.
    async fn ready(&mut self) -> Result<Instant, ChipError<I::Error>> {
        let period = self.config.period;
        let asked = self.port.now();
        let deadline = asked.max(self.due) + period + period;
        // An interrupt that may have been up for long tells nothing about when: take it back and wait for the next.
        // A histogram is only measured when it is asked for.
        self.stale |= !self.histogram && asked > self.due + period / 4;
        self.port.wait_until(self.due).await;
        let mut before = None;
        loop {
            let looks = self.port.now();
            let up = self.look().await?;
            let now = self.port.now();
            if up && !self.stale {
                // Between two looks; or, up at the first look, when the rhythm says, for all that is known.
                let seen = match before {
                    Some(before) => before + now.since(before) / 2,
                    None => now.min(self.due + (period - early(period))),
                };
                self.due = seen + early(period);
                return Ok(seen);
            }
            if up {
                self.port.write(register::SYSTEM_INTERRUPT_CLEAR, &[codec::CLEAR]).await?;
            }
            self.stale = false;
            if up {
                // The next one comes in the rhythm: nothing to look at, and no bus to take, before.
                let late = now.since(self.due + (period - early(period))).as_micros();
                let missed = if late == 0 { 0 } else { late.checked_div(period.as_micros()).unwrap_or(0) + 1 };
                if (1..=IN_RHYTHM).contains(&missed) {
                    self.due += (period - period / DRIFT) * missed;
                    self.port.wait_until(self.due).await;
                    continue;
                }
            }
            if looks > deadline {
                self.ranging = false;
                return Err(ChipError::NoSample);
            }
            before = Some(now);
            self.port.wait(POLL).await;
        }
    }
}

/// Model and module type of whoever answers at the port's address.
async fn identification<I: I2c, T: Timebase>(
    port: &mut Port<I2cRegisters<I>, T>,
) -> Result<[u8; 2], ChipError<I::Error>> {
    port.read(register::IDENTIFICATION_MODEL_ID).await
}

/// Is somebody at the port's address?
async fn answers<I: I2c, T: Timebase>(port: &mut Port<I2cRegisters<I>, T>) -> Result<bool, ChipError<I::Error>> {
    match identification(port).await {
        Err(ChipError::BusTimeout) => Err(ChipError::BusTimeout),
        outcome => Ok(outcome.is_ok()),
    }
}

/// Resets the chip that is at this address or has not been moved yet. What it says of itself is asked afterwards: one that a dropped
/// start left standing still says nothing.
async fn reset_by_register<I: I2c, T: Timebase>(
    port: &mut Port<I2cRegisters<I>, T>,
    address: u8,
) -> Result<(), ChipError<I::Error>> {
    port.move_to(codec::BOOT_ADDRESS);
    if address != codec::BOOT_ADDRESS {
        let taken = answers(port).await?;
        port.move_to(address);
        match answers(port).await? {
            // Once reset, both would be there.
            true if taken => return Err(ChipError::AddressTaken),
            true => {}
            false => port.move_to(codec::BOOT_ADDRESS),
        }
    }
    port.write(register::SOFT_RESET, &[codec::HOLD]).await?;
    port.wait(SOFT_RESET).await;
    // No document says which of its addresses it has now.
    match port.write(register::SOFT_RESET, &[codec::LET_GO]).await {
        Err(ChipError::Bus(_)) if address != codec::BOOT_ADDRESS => {
            port.move_to(codec::BOOT_ADDRESS);
            port.write(register::SOFT_RESET, &[codec::LET_GO]).await
        }
        outcome => outcome,
    }
}

/// A little early: the chip's clock may be fast by some per cent.
fn early(span: Duration) -> Duration {
    span - span / 8
}

impl<I: I2c, X: Xshut, T: Timebase> RangeFinder for Vl53l3cx<'_, I, X, T> {
    type Error = ChipError<I::Error>;

    async fn next(&mut self) -> Result<Sample<TofData>, Self::Error> {
        let outcome = self.started_measurement().await;
        if self.trial.is_some() {
            self.try_out(&outcome)?;
        }
        let (seen, reading) = outcome?;
        self.reading = Some(reading);
        let checked = !core::mem::replace(&mut self.first, false);
        let distance = reading.distance + self.config.offset;
        // Zero is what the chip says when it knows nothing, not a distance.
        let plausible = reading.distance > 0.0 && distance > 0.0 && distance <= self.reach();
        let data = TofData {
            distance: distance.max(0.0),
            sigma: reading.sigma,
            status: reading.status().number(),
            valid: checked && plausible && reading.status() == RangeStatus::Valid,
        };
        Ok(Sample { at: seen - self.config.budget / 2, data })
    }
}
