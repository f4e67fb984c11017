#![doc = include_str!("../README.md")]
#![no_std]

pub mod codec;

use codec::{Motion, Step, register};
use core::pin::pin;
use embedded_hal_async::spi::{Operation, SpiDevice};
#[cfg(feature = "embassy-time")]
pub use stampfly_driver_core::EmbassyClock;
use stampfly_driver_core::chip::bounded;
pub use stampfly_driver_core::chip::{Axis, AxisMap, ChipError, TransferLimit};
use stampfly_driver_core::time::sleep_until;
pub use stampfly_driver_core::{OpticalFlow, Sample, Timebase};
pub use stampfly_driver_core::{SensorError, SensorErrorKind, blocking, embedded_hal, embedded_hal_async};
use stampfly_types::Vec3;
pub use stampfly_types::messages::FlowData;
pub use stampfly_types::{Duration, Instant};

/// Bytes of the longest transfer, a burst.
const BURST: usize = 12;
/// From power-on to the first access ("Power-up sequence").
const POWER_UP: Duration = Duration::from_millis(45);
const AFTER_RESET: Duration = Duration::from_millis(5);
/// From an address to the data it asks for (tSRAD), ns.
const ADDRESS_TO_DATA: u32 = 35_000;
/// From the end of a write to the next access (tSWW, tSWR).
const AFTER_WRITE: Duration = Duration::from_micros(45);
/// From the end of a read to the next access (tSRW, tSRR).
const AFTER_READ: Duration = Duration::from_micros(20);
/// From the last clock of a write to the end of the chip select (tSCLK-NCS, table 5 of data sheet R1.10), ns. That of a read is 120 ns.
const WRITE_HOLD: u32 = 35_000;
/// How often a chip that runs is asked whether it still holds what it was told.
const WITNESS_INTERVAL: Duration = Duration::from_secs(1);
/// How often the chip's calibration is asked for before it counts as broken.
const ATTEMPTS: usize = 10;
/// Settings that depend on the chip.
const CALIBRATED: usize = 5;
/// How many pictures the self test looks at, and from one to the next; the chip makes one in 8 ms.
const PICTURES: usize = 5;
const PICTURE: Duration = Duration::from_millis(20);
/// So long a chip may see nothing at all before it is set up again.
const BLIND: Duration = Duration::from_secs(10);

/// What the driver is told.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// Time between two samples. Pictures come at 121 Hz: faster than that gives empty samples.
    pub interval: Duration,
    /// Angle of one count, rad; a lens of another distance has another.
    pub radians_per_count: f32,
}

impl Default for Config {
    /// 100 Hz, the module's own lens.
    fn default() -> Self {
        Self { interval: Duration::from_millis(10), radians_per_count: codec::RADIANS_PER_COUNT }
    }
}

/// The driver, on SPI in mode 3 at no more than 2 MHz. Implements [`OpticalFlow`].
///
/// `Sample::at` is the instant of the read; the newest picture in it is up to 8 ms older, which the chip does not tell.
/// `FlowData::interval` is the time since the counts were last emptied, whatever the caller's rhythm. After a read that
/// failed or was cancelled nobody knows what was lost: the driver empties the counts and begins a new interval, so no
/// sample ever covers less time than it says.
///
/// A chip without its settings goes on counting, badly and without saying so. A start therefore reads back all of them,
/// and once a second `next` reads back one: another value is [`ChipError::Restarted`], and the next call sets the chip up
/// again. A start that failed, wherever it was, is begun again from the reset. The registers are undocumented. One that reads the same other value at two starts in a row cannot be read back
/// and is not asked. What else may have gone wrong costs ten seconds: after as long with a quality of zero, which is also
/// what it sees in the dark, `next` says [`ChipError::NoSample`], and the one after sets the chip up again.
///
/// A sample costs 110 µs of bus, most of it the pause between address and data. `next` ends within the interval and
/// 40 ms; when it has to start the chip and every access is slow, within 4 s.
///
/// ```
/// # use stampfly_driver_fakes::memory::{Chip, Clock};
/// # let (device, clock) = (Chip::new(&[
/// #     (0x00, &[0x49]), (0x5F, &[0xB6]), (0x747, &[0x08]), (0x16, &[0x80, 0, 0, 0, 3, 0, 90, 1, 90, 9, 2, 7]),
/// # ]), Clock::default());
/// use stampfly_pmw3901::{AxisMap, Config, OpticalFlow, Pmw3901, blocking::block_on};
///
/// let mut flow = Pmw3901::new(device, clock, AxisMap::IDENTITY, Config::default());
/// let sample = block_on(flow.next()).expect("a picture");
/// assert!(sample.data.valid && sample.data.delta_y / sample.data.interval > 0.6, "to the right, rad/s");
/// ```
#[derive(Debug)]
pub struct Pmw3901<S, T> {
    device: S,
    clock: T,
    limit: TransferLimit,
    axes: AxisMap,
    config: Config,
    running: bool,
    /// When the counts were last emptied; `None` when that is unknown.
    emptied: Option<Instant>,
    /// When to ask next whether the chip restarted; `None` when it cannot be asked.
    witness: Option<Instant>,
    /// What the settings read back as after the last start.
    kept: Option<[u8; CALIBRATED + codec::SETTINGS]>,
    /// When it last saw anything.
    saw: Instant,
}

impl<S: SpiDevice, T: Timebase> Pmw3901<S, T> {
    /// A driver of the chip on this device.
    pub const fn new(device: S, clock: T, axes: AxisMap, config: Config) -> Self {
        Self {
            device,
            clock,
            limit: TransferLimit::SPI,
            axes,
            config,
            running: false,
            emptied: None,
            witness: None,
            kept: None,
            saw: Instant::ZERO,
        }
    }

    /// Gives up a transfer after this time instead of [`TransferLimit::SPI`].
    #[must_use]
    pub const fn with_transfer_limit(mut self, limit: TransferLimit) -> Self {
        self.limit = limit;
        self
    }

    /// Takes the driver apart: the device and the clock. The chip goes on counting.
    pub fn release(self) -> (S, T) {
        (self.device, self.clock)
    }

    /// Sets the chip up: reset, both identifications, calibration, performance registers, which it reads back. About
    /// 75 ms, twice that when something reads back otherwise.
    ///
    /// # Errors
    /// Another chip, one that does not give its calibration or keep its settings, the bus.
    pub async fn start(&mut self) -> Result<(), ChipError<S::Error>> {
        self.running = false;
        self.emptied = None;
        let calibrated = self.configure().await?;
        if self.proof_read(calibrated).await?.is_some() {
            let calibrated = self.configure().await?;
            if let Some(status) = self.proof_read(calibrated).await? {
                return Err(ChipError::Configuration { status });
            }
        }
        let (register, value) = codec::WITNESS;
        let kept = self.read(register).await? == value;
        self.saw = self.clock.now();
        self.witness = kept.then(|| self.saw + WITNESS_INTERVAL);
        self.running = true;
        Ok(())
    }

    /// Sets the chip up, reads all its settings back and looks at up to five pictures. 0.1 s, 0.2 s when the start needs
    /// its second try, within 4.2 s however slow the bus.
    ///
    /// The chip has no self test of its own: this one asks whether the picture and its exposure go together. It passes over
    /// any floor and in the dark, and cannot tell a covered lens from the dark. Afterwards the chip is set up.
    ///
    /// # Errors
    /// Those of [`start`](Self::start): [`ChipError::Identification`] for either of the two identifications,
    /// [`ChipError::Configuration`] for a calibration that is not there or a setting that was not kept;
    /// [`ChipError::Data`] when nobody answers any more; [`ChipError::SelfTest`] when no picture is one that the chip can
    /// have taken ([`Motion::is_exposed`]).
    pub async fn self_test(&mut self) -> Result<(), ChipError<S::Error>> {
        self.start().await?;
        for _ in 0..PICTURES {
            self.wait(PICTURE).await;
            let motion = self.burst().await?;
            self.wait(AFTER_READ).await;
            if motion.is_exposed() {
                return Ok(());
            }
        }
        Err(ChipError::SelfTest)
    }

    /// From any state to the end of the list. Gives the settings that depend on the chip: bank, register, value.
    async fn configure(&mut self) -> Result<[Option<(u8, u8, u8)>; CALIBRATED], ChipError<S::Error>> {
        let ready = self.clock.now() + POWER_UP;
        sleep_until(&mut self.clock, ready).await;
        // Reset is in the first bank, and a start that failed may have left another.
        self.write(register::BANK, 0).await?;
        self.write(register::POWER_UP_RESET, codec::RESET).await?;
        self.wait(AFTER_RESET).await;
        let (found, inverse) = (self.read(register::PRODUCT_ID).await?, self.read(register::INVERSE_PRODUCT_ID).await?);
        if found != codec::PRODUCT || inverse != !codec::PRODUCT {
            return Err(ChipError::Identification { found: u16::from_be_bytes([found, inverse]) });
        }
        for offset in 0..5 {
            self.read(register::MOTION + offset).await?;
        }
        let calibrated = self.calibrate().await?;
        for step in codec::PERFORMANCE {
            match *step {
                Step::Write(register, value) => self.write(register, value).await?,
                Step::Wait(millis) => self.wait(Duration::from_millis(u64::from(millis))).await,
            }
        }
        Ok(calibrated)
    }

    /// Reads every setting back. Gives the first that is neither what was written nor what it was after the start
    /// before, which is all that a register that cannot be read back will ever say.
    async fn proof_read(
        &mut self,
        calibrated: [Option<(u8, u8, u8)>; CALIBRATED],
    ) -> Result<Option<u8>, ChipError<S::Error>> {
        let before = self.kept.take();
        let mut kept = [0; CALIBRATED + codec::SETTINGS];
        let mut wrong = None;
        // The list ends in the first bank. It comes last, so that its last registers tell that this is selected.
        let mut bank = 0;
        let settings = calibrated.into_iter().chain(codec::settings().map(Some));
        for (number, (setting, kept)) in settings.zip(&mut kept).enumerate() {
            let Some((selected, register, value)) = setting else { continue };
            if core::mem::replace(&mut bank, selected) != selected {
                self.write(register::BANK, selected).await?;
            }
            *kept = self.read(register).await?;
            if *kept != value {
                // It may have been garbled on its way back.
                *kept = self.read(register).await?;
            }
            let as_before = before.and_then(|before| before.get(number).copied()) == Some(*kept);
            if *kept != value && !as_before {
                wrong = wrong.or(Some(*kept));
            }
        }
        self.kept = Some(kept);
        Ok(wrong)
    }

    /// Has the chip lost what it was told?
    async fn check(&mut self) -> Result<(), ChipError<S::Error>> {
        if self.witness.is_none_or(|due| self.clock.now() < due) {
            return Ok(());
        }
        // From the end of the last burst.
        self.wait(AFTER_READ).await;
        let (register, value) = codec::WITNESS;
        // Twice, before a wrong bit on the bus costs a start.
        if self.read(register).await? == value || self.read(register).await? == value {
            self.witness = Some(self.clock.now() + WITNESS_INTERVAL);
            return Ok(());
        }
        self.running = false;
        Err(ChipError::Restarted)
    }

    /// The part of the list that depends on the chip.
    async fn calibrate(&mut self) -> Result<[Option<(u8, u8, u8)>; CALIBRATED], ChipError<S::Error>> {
        for (register, value) in codec::PREPARE {
            self.write(register, value).await?;
        }
        let mut status = self.read(0x47).await?;
        for _ in 1..ATTEMPTS {
            if status == 0x08 {
                break;
            }
            self.write(0x43, 0x10).await?;
            status = self.read(0x47).await?;
        }
        if status != 0x08 {
            return Err(ChipError::Configuration { status });
        }
        let range = if self.read_twice(0x67).await? & 0x80 != 0 { 0x04 } else { 0x02 };
        self.write(0x48, range).await?;
        for (register, value) in codec::PREPARE_CALIBRATION {
            self.write(register, value).await?;
        }
        if self.read_twice(0x73).await? != 0 {
            return Ok([Some((0x00, 0x50, 0x00)), Some((0x00, 0x51, 0x7B)), Some((0x0E, 0x48, range)), None, None]);
        }
        let [first, second] = codec::calibration(self.read_twice(0x70).await?, self.read_twice(0x71).await?);
        for (register, value) in codec::BEFORE_CALIBRATION.into_iter().chain([(0x70, first), (0x71, second)]) {
            self.write(register, value).await?;
        }
        let fixed = [(0x00, 0x50, 0x00), (0x00, 0x51, 0x70), (0x0E, 0x48, range)];
        let [a, b, c] = fixed.map(Some);
        Ok([a, b, c, Some((0x0E, 0x70, first)), Some((0x0E, 0x71, second))])
    }

    async fn burst(&mut self) -> Result<Motion, ChipError<S::Error>> {
        let mut bytes = [0; 12];
        let mut operations = [
            Operation::Write(&[register::MOTION_BURST]),
            Operation::DelayNs(ADDRESS_TO_DATA),
            Operation::Read(&mut bytes),
        ];
        bounded(&mut self.clock, self.limit.of(BURST), pin!(self.device.transaction(&mut operations))).await?;
        if let Some(motion) = Motion::decode(&bytes) {
            return Ok(motion);
        }
        // Nobody there. Whoever comes back has lost its registers.
        self.running = false;
        Err(ChipError::Data)
    }

    async fn read(&mut self, register: u8) -> Result<u8, ChipError<S::Error>> {
        let mut bytes = [0];
        let mut operations =
            [Operation::Write(&[register]), Operation::DelayNs(ADDRESS_TO_DATA), Operation::Read(&mut bytes)];
        bounded(&mut self.clock, self.limit.of(BURST), pin!(self.device.transaction(&mut operations))).await?;
        self.wait(AFTER_READ).await;
        let [value] = bytes;
        Ok(value)
    }

    /// Reads what will be believed until the next start.
    async fn read_twice(&mut self, register: u8) -> Result<u8, ChipError<S::Error>> {
        let first = self.read(register).await?;
        if self.read(register).await? == first { Ok(first) } else { Err(ChipError::Data) }
    }

    async fn write(&mut self, register: u8, value: u8) -> Result<(), ChipError<S::Error>> {
        let mut operations = [Operation::Write(&[register | 0x80, value]), Operation::DelayNs(WRITE_HOLD)];
        bounded(&mut self.clock, self.limit.of(BURST), pin!(self.device.transaction(&mut operations))).await?;
        self.wait(AFTER_WRITE).await;
        Ok(())
    }

    async fn wait(&mut self, span: Duration) {
        let instant = self.clock.now() + span;
        sleep_until(&mut self.clock, instant).await;
    }
}

impl<S: SpiDevice, T: Timebase> OpticalFlow for Pmw3901<S, T> {
    type Error = ChipError<S::Error>;

    async fn next(&mut self) -> Result<Sample<FlowData>, Self::Error> {
        if !self.running {
            self.start().await?;
        }
        self.check().await?;
        let emptied = match self.emptied {
            Some(emptied) => emptied,
            None => {
                self.burst().await?;
                let now = self.clock.now();
                self.emptied = Some(now);
                now
            }
        };
        sleep_until(&mut self.clock, emptied + self.config.interval).await;
        // Until the burst is over, nobody knows what it takes away.
        self.emptied = None;
        let motion = self.burst().await?;
        let at = self.clock.now();
        if at <= emptied {
            return Err(ChipError::ClockStopped);
        }
        self.emptied = Some(at);
        if motion.quality > 0 {
            self.saw = at;
        } else if at.since(self.saw) > BLIND {
            self.running = false;
            return Err(ChipError::NoSample);
        }
        let counts = Vec3::new(f32::from(motion.delta_x), f32::from(motion.delta_y), 0.0);
        let angle = self.axes.to_body(counts) * self.config.radians_per_count;
        let data = FlowData {
            delta_x: angle.x,
            delta_y: angle.y,
            interval: at.since(emptied).seconds(),
            quality: motion.quality,
            valid: motion.is_valid(),
        };
        Ok(Sample { at, data })
    }
}
