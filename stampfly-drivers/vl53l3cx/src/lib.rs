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

/// Duration of a reset by the pin. The data sheet gives no minimum.
const RESET: Duration = Duration::from_millis(1);
/// Duration of a reset by the register: 100 µs as in public drivers of the VL53L1X.
const SOFT_RESET: Duration = Duration::from_micros(100);
/// Time from a reset to the first access, at most 1.2 ms (§ "Power sequence"), with a margin.
const BOOT: Duration = Duration::from_millis(4);
/// Time limit for the start of the firmware.
const BOOT_LIMIT: Duration = Duration::from_millis(100);
/// Time limit for another driver that wakes its chip, slightly longer than that takes.
const NEIGHBOUR_LIMIT: Duration = Duration::from_millis(200);
/// Reciprocal of the largest relative error of the chip's clock.
const DRIFT: u64 = 32;
/// Number of periods after which that error amounts to half a period, so that the phase is unknown.
const IN_RHYTHM: u64 = DRIFT / 2;
/// Number of repeated results after which the driver gives up; each is cleared and the next one
/// awaited.
const REPETITIONS: usize = 2;
/// Pause between two reads of the interrupt status while a measurement is expected.
const POLL: Duration = Duration::from_millis(2);
/// Number of new measurements that the self test requires.
const ADVANCES: usize = 2;

/// The driver. Implements [`RangeFinder`].
///
/// `Sample::at` is the middle of the measurement, accurate to the 2 ms between two reads of the
/// chip.
///
/// # Ranging modes
/// [`Config::ranging`] selects whether the chip computes the distance, or the driver from a
/// histogram. In [`Ranging::Automatic`] one call returns [`ChipError::Implausible`] when the driver
/// changes to histograms. If these yield no measurement either, one call returns
/// [`ChipError::SelfTest`] and the driver changes back. After either error the next call starts the
/// chip again.
///
/// A sample is valid when its status is [`RangeStatus::Valid`] and its distance is positive and
/// within the range of the mode. The first sample after a start is not valid, because wrap-around
/// is detected by comparing measurements. `status` is [`RangeStatus::number`];
/// [`reading`](Self::reading) returns the complete measurement.
///
/// # Several chips on a bus
/// Every chip starts at address 0x29, so each needs a pin on its XSHUT and an address of its own.
/// Creating a driver resets its chip: create all drivers, with one shared [`BootAddress`], before
/// using the first. After that they start and restart in any order and in separate tasks.
///
/// A chip that lost its power is back at 0x29 and no longer answers at its own address. Its driver
/// returns [`ChipError::Restarted`], and the next call resets and moves this chip without affecting
/// others. When two chips are back at 0x29, the first driver that is called holds its chip in reset
/// ([`ChipError::AddressTaken`]) until the other chip has been moved.
///
/// XSHUT must rise only while the bus is idle. The driver therefore raises it directly after a
/// transfer of its own. This suffices when all users of the bus are tasks of one executor.
/// Otherwise pass an [`Xshut`] of your own that keeps the others off the bus meanwhile.
///
/// A single chip may stay at [`BOOT_ADDRESS`](Vl53l3cx::BOOT_ADDRESS).
///
/// # Boards without XSHUT
/// Pass [`NoXshut`] instead of a pin. The driver searches for the chip at its address, to which it
/// may have been moved, and at 0x29, resets it by a register and searches again. One such chip may
/// share a bus with chips that have pins: start it before them, with an address of its own. Two
/// chips without a pin may share a bus only if other software has moved them to different
/// addresses. A start takes 4 ms longer, because the chip may just have been powered on.
///
/// # Timing
/// The first sample takes 10 ms and two measurements, 80 ms in total. `next` returns within two
/// periods and 20 ms ([`ChipError::NoSample`]), and one period later for each of up to two repeated
/// results. When it has to start the chip, it returns within four more periods and 350 ms. With
/// histograms the first sample takes 100 ms, and each further one the budget and 4 to 6 ms.
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
/// // Two handles of one bus, and a pin on the XSHUT of each chip.
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
    /// The interrupt may belong to an old measurement: it was set for some time, or clearing it was
    /// interrupted.
    stale: bool,
    /// No measurement since the start.
    first: bool,
    /// Earliest time of the next measurement.
    due: Instant,
    /// The newest result since the start, as read.
    block: Option<[u8; RESULT_BYTES]>,
    reading: Option<Reading>,
    /// State of the histogram mode since the start.
    session: Option<Session>,
    /// Whether histogram mode is selected.
    histogram: bool,
    /// Evaluation of the first results; `None` once the ranging mode is settled.
    trial: Option<Trial>,
    doubt: Option<Implausible>,
}

impl Vl53l3cx<'_, (), (), ()> {
    /// Address of every chip after a start.
    pub const BOOT_ADDRESS: u8 = codec::BOOT_ADDRESS;
}

impl<'b, I: I2c, X: Xshut, T: Timebase> Vl53l3cx<'b, I, X, T> {
    /// A driver that will move its chip to this address. Resets the chip with its pin; without a
    /// pin pass [`NoXshut`].
    pub fn new(bus: I, mut xshut: X, boot: &'b BootAddress, address: u8, clock: T, config: Config) -> Self {
        // The first start reports a pin that refuses.
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

    /// Takes the driver apart and returns the bus, the pin and the clock. The chip continues to
    /// measure at its address.
    pub fn release(self) -> (I, X, T) {
        let (bus, clock) = self.port.release();
        (bus, self.xshut, clock)
    }

    /// The newest measurement with all its values; `None` before the first.
    #[must_use]
    pub const fn reading(&self) -> Option<Reading> {
        self.reading
    }

    /// The present ranging mode: [`Ranging::Light`] or [`Ranging::Histogram`].
    #[must_use]
    pub const fn ranging(&self) -> Ranging {
        if self.histogram { Ranging::Histogram } else { Ranging::Light }
    }

    /// Why [`Ranging::Automatic`] left the light mode; `None` if it did not.
    #[must_use]
    pub const fn doubt(&self) -> Option<Implausible> {
        self.doubt
    }

    /// Sets the chip up: reset, identification, address, configuration, a first measurement that is
    /// discarded.
    ///
    /// # Errors
    /// [`ChipError::Identification`], [`ChipError::InvalidConfiguration`],
    /// [`ChipError::AddressTaken`], [`ChipError::Configuration`] when the firmware does not start
    /// or a setting is not kept, and errors of the bus.
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
        // The first measurement searches the detector's bias; the following ones only track its
        // drift.
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

    /// Sets the chip up, checks that it keeps its times and limits, and measures three times.
    /// 0.15 s by default; at most 21 periods and one second on a slow bus with
    /// [`TransferLimit::I2C_SENSORS`].
    ///
    /// The chip tests laser and detector in every measurement: this test checks that they pass and
    /// that measurements continue. It passes without a target, so it does not detect a covered
    /// window. The chip measures afterwards, and the next sample is the next measurement. Other
    /// chips on the bus are not affected.
    ///
    /// # Errors
    /// Those of [`start`](Self::start), including [`ChipError::Configuration`] when the firmware
    /// does not start or does not keep its times; [`ChipError::NoSample`] when measurements stop or
    /// their number does not advance; [`ChipError::Data`] when no chip drives the bus;
    /// [`ChipError::SelfTest`] when the chip reports a fault of laser or detector, a failed
    /// computation or an unknown status.
    pub async fn self_test(&mut self) -> Result<(), ChipError<I::Error>> {
        self.start().await?;
        // The first result after a start is empty; only its number is used.
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

    /// The next result, decoded, and the time at which it was ready.
    async fn measurement(&mut self) -> Result<(Instant, Reading), ChipError<I::Error>> {
        if self.histogram {
            return self.histogram().await;
        }
        let (seen, block) = self.result().await?;
        Ok((seen, Reading::decode(&block).ok_or(ChipError::Data)?))
    }

    /// Starts the chip if necessary and returns the next measurement.
    async fn started_measurement(&mut self) -> Result<(Instant, Reading), ChipError<I::Error>> {
        if !self.ranging {
            self.start().await?;
        }
        self.measurement().await
    }

    /// Evaluates a result while the ranging mode is not settled, and settles it.
    fn try_out(
        &mut self,
        outcome: &Result<(Instant, Reading), ChipError<I::Error>>,
    ) -> Result<(), ChipError<I::Error>> {
        let now = self.port.now();
        let result = match outcome {
            // The first result after a start is empty.
            Ok(_) if self.first => return Ok(()),
            Ok((_, reading)) => Some(*reading),
            Err(ChipError::NoSample) => None,
            // The other mode would not cure any other error.
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
            // Histograms find no target either, so there is no reason to prefer them.
            Err(ChipError::SelfTest)
        }
    }

    /// Starts the chip from any state and moves it to its own address.
    async fn wake(&mut self) -> Result<(), ChipError<I::Error>> {
        let Self { port, xshut, boot, address, .. } = self;
        // First of all: a chip that has restarted by itself must not block the boot address.
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
        // Addresses at which the chip may answer after its start.
        let mut places = [codec::BOOT_ADDRESS; 2];
        if X::WIRED {
            port.move_to(codec::BOOT_ADDRESS);
            port.wait(RESET).await;
            if answers(port).await? {
                return Err(ChipError::AddressTaken);
            }
            // XSHUT must not rise during a transfer (DS13204, "Power sequence"). The driver's own
            // transfer has just ended, and no other task of the executor runs before the next
            // await. Nothing may come between the two.
            waking.release().map_err(|_| ChipError::Pin)?;
        } else {
            // The chip may just have been powered on.
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

    /// Largest valid distance, m.
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
        // Read back, because a wrong bit here would only show as wrong distances.
        let kept: [u8; 12] = self.port.read(register::RANGE_CONFIG_TIMEOUT_MACROP_A).await?;
        if kept != ranging {
            return Err(ChipError::Configuration { status: kept[2] });
        }
        self.port.write(register::SD_CONFIG_WOI_SD0, &mode.windows()).await?;
        let oscillator = u16::from_be_bytes(self.port.read_twice(register::RESULT_OSC_CALIBRATE_VAL).await?);
        let period = codec::inter_measurement(self.config.period, oscillator);
        self.port.write(register::SYSTEM_INTERMEASUREMENT_PERIOD, &period).await
    }

    /// Reads from a running chip. Two missing acknowledges mean that it no longer answers at its
    /// address.
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

    /// Waits for a new result and clears its interrupt.
    async fn result(&mut self) -> Result<(Instant, [u8; RESULT_BYTES]), ChipError<I::Error>> {
        for _ in 0..=REPETITIONS {
            let seen = self.ready().await?;
            // Until the interrupt is cleared, the next one may belong to this measurement again.
            self.stale = true;
            let block: [u8; RESULT_BYTES] = self.read(register::RESULT_RANGE_STATUS).await?;
            self.port.write(register::SYSTEM_INTERRUPT_CLEAR, &[codec::CLEAR]).await?;
            self.stale = false;
            // Results are numbered: an identical one means that the chip missed the last clear.
            if self.block.replace(block) != Some(block) {
                return Ok((seen, block));
            }
        }
        self.ranging = false;
        Err(ChipError::NoSample)
    }

    /// Reads the interrupt status. Detects a chip that restarted by its other settings.
    async fn look(&mut self) -> Result<bool, ChipError<I::Error>> {
        let [mut control, mut status] = self.read(register::GPIO_HV_MUX_CTRL).await?;
        if control != codec::ACTIVE_HIGH {
            // Two reads, so that one wrong bit on the bus does not cause a new set-up.
            [control, status] = self.read(register::GPIO_HV_MUX_CTRL).await?;
        }
        if control != codec::ACTIVE_HIGH {
            self.ranging = false;
            return Err(ChipError::Restarted);
        }
        Ok(status & 1 != 0)
    }

    /// Waits for a new measurement and returns the time at which it was ready.
    async fn ready(&mut self) -> Result<Instant, ChipError<I::Error>> {
        let period = self.config.period;
        let asked = self.port.now();
        let deadline = asked.max(self.due) + period + period;
        // An interrupt that may have been set for some time does not show when: clear it and wait
        // for the next. Not with histograms, which are measured only on request.
        self.stale |= !self.histogram && asked > self.due + period / 4;
        self.port.wait_until(self.due).await;
        let mut before = None;
        loop {
            let looks = self.port.now();
            let up = self.look().await?;
            let now = self.port.now();
            if up && !self.stale {
                // Between the last two reads; if it was set at the first read, at the time
                // predicted by the period.
                let seen = match before {
                    Some(before) => before + now.since(before) / 2,
                    None => now.min(self.due + (period - early(period))),
                };
                // Wakes up before the measurement is expected, to see the interrupt rise.
                self.due = seen + early(period);
                return Ok(seen);
            }
            if up {
                self.port.write(register::SYSTEM_INTERRUPT_CLEAR, &[codec::CLEAR]).await?;
            }
            self.stale = false;
            if up {
                // The next measurement follows with the period: no need to occupy the bus before.
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

/// Reads model and module type at the port's address.
async fn identification<I: I2c, T: Timebase>(
    port: &mut Port<I2cRegisters<I>, T>,
) -> Result<[u8; 2], ChipError<I::Error>> {
    port.read(register::IDENTIFICATION_MODEL_ID).await
}

/// Whether a chip answers at the port's address.
async fn answers<I: I2c, T: Timebase>(port: &mut Port<I2cRegisters<I>, T>) -> Result<bool, ChipError<I::Error>> {
    match identification(port).await {
        Err(ChipError::BusTimeout) => Err(ChipError::BusTimeout),
        outcome => Ok(outcome.is_ok()),
    }
}

/// Resets the chip at this address, or at the boot address if it has not been moved. Does not check
/// its identification, because a chip that a dropped start left in reset does not return one.
async fn reset_by_register<I: I2c, T: Timebase>(
    port: &mut Port<I2cRegisters<I>, T>,
    address: u8,
) -> Result<(), ChipError<I::Error>> {
    port.move_to(codec::BOOT_ADDRESS);
    if address != codec::BOOT_ADDRESS {
        let taken = answers(port).await?;
        port.move_to(address);
        match answers(port).await? {
            // After the reset both would be at the boot address.
            true if taken => return Err(ChipError::AddressTaken),
            true => {}
            false => port.move_to(codec::BOOT_ADDRESS),
        }
    }
    port.write(register::SOFT_RESET, &[codec::HOLD]).await?;
    port.wait(SOFT_RESET).await;
    // The address of the chip in this state is not documented.
    match port.write(register::SOFT_RESET, &[codec::LET_GO]).await {
        Err(ChipError::Bus(_)) if address != codec::BOOT_ADDRESS => {
            port.move_to(codec::BOOT_ADDRESS);
            port.write(register::SOFT_RESET, &[codec::LET_GO]).await
        }
        outcome => outcome,
    }
}

/// Slightly less than `span`, because the chip's clock may be fast by some per cent.
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
        // The chip reports a distance of zero when it has none.
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
