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

/// Bytes of the longest transfer, the motion burst.
const BURST: usize = 12;
/// Time from power-on to the first access ("Power-up sequence").
const POWER_UP: Duration = Duration::from_millis(45);
const AFTER_RESET: Duration = Duration::from_millis(5);
/// Time from an address to its data (tSRAD), ns.
const ADDRESS_TO_DATA: u32 = 35_000;
/// Time from the end of a write to the next access (tSWW, tSWR).
const AFTER_WRITE: Duration = Duration::from_micros(45);
/// Time from the end of a read to the next access (tSRW, tSRR).
const AFTER_READ: Duration = Duration::from_micros(20);
/// Time from the last clock of a write to the release of the chip select (tSCLK-NCS, table 5 of
/// data sheet R1.10), ns. For a read it is 120 ns.
const WRITE_HOLD: u32 = 35_000;
/// Period of the check that a running chip still holds its settings.
const WITNESS_INTERVAL: Duration = Duration::from_secs(1);
/// Number of attempts to read the chip's calibration.
const ATTEMPTS: usize = 10;
/// Number of settings that depend on the individual chip.
const CALIBRATED: usize = 5;
/// Self test: number of images, and the pause before each. The chip takes one image per 8 ms.
const PICTURES: usize = 5;
const PICTURE: Duration = Duration::from_millis(20);
/// Time with a quality of zero after which the chip is set up again.
const BLIND: Duration = Duration::from_secs(10);

/// Configuration of the driver.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// Time between two samples. The chip takes images at 121 Hz; a shorter interval yields samples
    /// without motion.
    pub interval: Duration,
    /// Angle of one count, rad. Depends on the focal length of the lens.
    pub radians_per_count: f32,
}

impl Default for Config {
    /// 100 Hz, with the lens of the module.
    fn default() -> Self {
        Self { interval: Duration::from_millis(10), radians_per_count: codec::RADIANS_PER_COUNT }
    }
}

/// The driver, on SPI in mode 3 at no more than 2 MHz. Implements [`OpticalFlow`].
///
/// `Sample::at` is the instant of the read. The newest image in it is up to 8 ms older; the chip
/// does not report its age. `FlowData::interval` is the time since the counts were last reset,
/// independent of the caller's timing. After a read that failed or was dropped, the lost counts are
/// unknown: the driver resets the counts and starts a new interval, so that the counts of a sample
/// always match its interval.
///
/// A chip without its settings continues to count, with poor quality and no indication of the
/// fault. `start` therefore reads all settings back, and `next` reads one back every second. On a
/// mismatch it returns [`ChipError::Restarted`], and the next call sets the chip up again. A start
/// that failed at any point is repeated from the reset.
///
/// The registers of the settings are undocumented. A register that reads the same other value in
/// two consecutive starts counts as write-only and is not checked. To recover from faults that this
/// leaves undetected, `next` returns [`ChipError::NoSample`] after ten seconds with a quality of
/// zero, which also occurs in the dark, and the following call sets the chip up again.
///
/// A sample takes 110 µs on the bus, most of it the pause between address and data. `next` returns
/// within the interval and 40 ms; with a start and slow accesses, within 4 s.
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
    /// Time of the last reset of the counts; `None` when unknown.
    emptied: Option<Instant>,
    /// Time of the next check for a restart; `None` when the register cannot be read back.
    witness: Option<Instant>,
    /// Settings as read back after the last start.
    kept: Option<[u8; CALIBRATED + codec::SETTINGS]>,
    /// Time of the last sample with a quality above zero.
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

    /// Takes the driver apart and returns the device and the clock. The chip continues to count.
    pub fn release(self) -> (S, T) {
        (self.device, self.clock)
    }

    /// Sets the chip up: reset, both identifications, calibration, performance registers with
    /// read-back. About 75 ms, twice that after a mismatch.
    ///
    /// # Errors
    /// [`ChipError::Identification`], [`ChipError::Configuration`] when the chip does not provide
    /// its calibration or does not keep its settings, and errors of the bus.
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

    /// Sets the chip up, reads all settings back and checks up to five images. 0.1 s, 0.2 s when
    /// the start needs a second attempt, at most 4.2 s on a slow bus.
    ///
    /// The chip has no self test of its own: this one checks that image and exposure are
    /// consistent. It passes over any floor and in the dark, and cannot distinguish a covered lens
    /// from the dark. The chip is set up afterwards.
    ///
    /// # Errors
    /// Those of [`start`](Self::start): [`ChipError::Identification`] for either identification,
    /// [`ChipError::Configuration`] for a missing calibration or a setting that was not kept;
    /// [`ChipError::Data`] when the chip no longer answers; [`ChipError::SelfTest`] when the chip
    /// cannot have taken any of the images ([`Motion::is_exposed`]).
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

    /// Configures the chip from any state, up to the end of the list. Returns the settings that
    /// depend on the chip: bank, register, value.
    async fn configure(&mut self) -> Result<[Option<(u8, u8, u8)>; CALIBRATED], ChipError<S::Error>> {
        let ready = self.clock.now() + POWER_UP;
        sleep_until(&mut self.clock, ready).await;
        // The reset register is in bank 0, and a failed start may have left another bank selected.
        self.write(register::BANK, 0).await?;
        self.write(register::POWER_UP_RESET, codec::RESET).await?;
        self.wait(AFTER_RESET).await;
        let (found, inverse) = (self.read(register::PRODUCT_ID).await?, self.read(register::INVERSE_PRODUCT_ID).await?);
        if found != codec::PRODUCT || inverse != !codec::PRODUCT {
            return Err(ChipError::Identification { found: u16::from_be_bytes([found, inverse]) });
        }
        // Part of the data sheet's start sequence: reading the motion registers clears them.
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

    /// Reads every setting back. Returns the first value that differs both from the written value
    /// and from the one after the previous start; a register that is write-only reads the same in
    /// both.
    async fn proof_read(
        &mut self,
        calibrated: [Option<(u8, u8, u8)>; CALIBRATED],
    ) -> Result<Option<u8>, ChipError<S::Error>> {
        let before = self.kept.take();
        let mut kept = [0; CALIBRATED + codec::SETTINGS];
        let mut wrong = None;
        // The list ends in bank 0. Checking that bank last also shows that it is selected.
        let mut bank = 0;
        let settings = calibrated.into_iter().chain(codec::settings().map(Some));
        for (number, (setting, kept)) in settings.zip(&mut kept).enumerate() {
            let Some((selected, register, value)) = setting else { continue };
            if core::mem::replace(&mut bank, selected) != selected {
                self.write(register::BANK, selected).await?;
            }
            *kept = self.read(register).await?;
            if *kept != value {
                // A second read, in case the first was corrupted on the bus.
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

    /// Checks that the chip still holds its settings.
    async fn check(&mut self) -> Result<(), ChipError<S::Error>> {
        if self.witness.is_none_or(|due| self.clock.now() < due) {
            return Ok(());
        }
        // The minimum pause after the previous burst.
        self.wait(AFTER_READ).await;
        let (register, value) = codec::WITNESS;
        // Two reads, so that one wrong bit on the bus does not cause a new set-up.
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
        // The chip prepares its calibration; 0x08 reports that it is ready.
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
        // Undocumented values, as in the data sheet's list.
        let range = if self.read_twice(0x67).await? & 0x80 != 0 { 0x04 } else { 0x02 };
        self.write(0x48, range).await?;
        for (register, value) in codec::PREPARE_CALIBRATION {
            self.write(register, value).await?;
        }
        // The data sheet's list writes a calibration back only when this register reads zero.
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
        // No chip answers. When it answers again, it will have lost its registers.
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

    /// Reads a value that stays in use until the next start, twice, and compares.
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
        // Until the burst has ended, the counts it resets are unknown.
        self.emptied = None;
        let motion = self.burst().await?;
        let at = self.clock.now();
        // An interval of zero would make every angle an infinite rate.
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
