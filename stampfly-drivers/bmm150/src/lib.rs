#![doc = include_str!("../README.md")]
#![no_std]

pub mod codec;
mod config;

use codec::{Reading, Trim, register};
pub use config::{Config, Preset, Rate};
use embedded_hal_async::i2c::I2c;
use embedded_hal_async::spi::SpiDevice;
#[cfg(feature = "embassy-time")]
pub use stampfly_driver_core::EmbassyClock;
use stampfly_driver_core::chip::Port;
pub use stampfly_driver_core::chip::{
    Axis, AxisMap, ChipError, I2cRegisters, Registers, SpiRegisters, TransferLimit, Wires,
};
pub use stampfly_driver_core::{Magnetometer, Sample, Timebase};
pub use stampfly_driver_core::{SensorError, SensorErrorKind, blocking, embedded_hal, embedded_hal_async};
pub use stampfly_types::messages::MagData;
pub use stampfly_types::{Duration, Instant};

/// Time from power-on of the chip's logic to the first access: 3 ms.
const START_UP: Duration = Duration::from_millis(3);
/// Time limit of the self test.
const SELF_TEST_LIMIT: Duration = Duration::from_millis(20);
/// Pause between two reads of the data while new data is expected.
const POLL: Duration = Duration::from_millis(2);

/// The driver. Implements [`Magnetometer`].
///
/// `Sample::at` is the middle of the measurement, accurate to the 2 ms between two reads of the
/// chip. A field out of range is [`ChipError::Data`]. The chip stores only its newest sample and
/// not its time, so a late caller gets the following sample, as does a caller whose previous call
/// was dropped during a transfer. `next` returns within two periods and 20 ms, 10 ms later when it
/// sets the chip up.
///
/// ```
/// # use stampfly_driver_fakes::memory::{Chip, Clock};
/// # let trim = [0, 0, 9, 9, 9, 0, 0, 26, 26, 9, 9, 0xFB, 0x02, 0xAB, 0x60, 0x8D, 0x1B, 0, 0, 0xFD, 29];
/// # let (bus, clock) = (Chip::new(&[
/// #     (0x40, &[0x32]), (0x42, &[0x20, 0x03, 0x40, 0x06, 0xE8, 0x03, 0x35, 0x6E]), (0x5D, &trim),
/// # ]), Clock::default());
/// use stampfly_bmm150::{AxisMap, Bmm150, Config, Magnetometer, blocking::block_on};
///
/// let mut compass = Bmm150::i2c(bus, Bmm150::ALL_LOW, clock, AxisMap::IDENTITY, Config::default());
/// let sample = block_on(compass.next()).expect("a measurement");
/// assert!(sample.data.field.norm() > 20.0, "microtesla");
/// ```
#[derive(Debug)]
pub struct Bmm150<R, T> {
    port: Port<R, T>,
    axes: AxisMap,
    config: Config,
    /// Trim of the chip; `None` until it is set up.
    trim: Option<Trim>,
    /// Earliest time of the next sample.
    due: Instant,
}

impl Bmm150<(), ()> {
    /// Address with CSB and SDO connected to ground, as on the StampFly.
    pub const ALL_LOW: u8 = 0x10;
}

impl<I: I2c, T: Timebase> Bmm150<I2cRegisters<I>, T> {
    /// The chip with this address on I2C, with its pin PS at the supply voltage.
    pub const fn i2c(bus: I, address: u8, clock: T, axes: AxisMap, config: Config) -> Self {
        Self::new(I2cRegisters::new(bus, address), clock, axes, config)
    }
}

impl<S: SpiDevice, T: Timebase> Bmm150<SpiRegisters<S, 0>, T> {
    /// The chip on four-wire SPI, mode 0 or 3, up to 10 MHz, with its pin PS at ground.
    pub const fn spi(device: S, clock: T, axes: AxisMap, config: Config) -> Self {
        Self::new(SpiRegisters(device), clock, axes, config)
    }
}

impl<R: Registers, T: Timebase> Bmm150<R, T> {
    const fn new(registers: R, clock: T, axes: AxisMap, config: Config) -> Self {
        Self { port: Port::new(registers, clock, R::LIMIT), axes, config, trim: None, due: Instant::ZERO }
    }

    stampfly_driver_core::transfer_limit!();

    stampfly_driver_core::release!();

    /// Sets the chip up: power, reset, identification, trim, repetitions, rate. 7 ms.
    ///
    /// # Errors
    /// [`ChipError::Identification`], [`ChipError::Data`] for a missing trim,
    /// [`ChipError::InvalidConfiguration`], and errors of the bus.
    pub async fn start(&mut self) -> Result<(), ChipError<R::Error>> {
        self.set_up().await.map(|_| ())
    }

    /// Runs the self test of the chip. Takes 10 to 30 ms; the next call sets the chip up again.
    ///
    /// # Errors
    /// [`ChipError::SelfTest`], and those of [`start`](Self::start).
    pub async fn self_test(&mut self) -> Result<(), ChipError<R::Error>> {
        self.wake().await?;
        self.port.write(register::MODE, &[codec::SELF_TEST]).await?;
        let deadline = self.port.now() + SELF_TEST_LIMIT;
        loop {
            self.port.wait(POLL).await;
            let looks = self.port.now();
            let [mode]: [u8; 1] = self.port.read(register::MODE).await?;
            if mode & 1 == 0 {
                break;
            }
            if looks > deadline {
                return Err(ChipError::SelfTest);
            }
        }
        let data = self.port.read(register::DATA_X_LSB).await?;
        if codec::passes_self_test(&data) { Ok(()) } else { Err(ChipError::SelfTest) }
    }

    /// Resets the chip from any state, leaves it in sleep mode and checks its identification.
    async fn wake(&mut self) -> Result<(), ChipError<R::Error>> {
        self.trim = None;
        // In suspend mode only this register can be accessed.
        self.port.write(register::POWER, &[codec::POWER_ON]).await?;
        self.port.wait(START_UP).await;
        self.port.write(register::POWER, &[codec::SOFT_RESET]).await?;
        self.port.wait(START_UP).await;
        let [found]: [u8; 1] = self.port.read(register::CHIP_ID).await?;
        if found == codec::CHIP_ID_VALUE { Ok(()) } else { Err(ChipError::Identification { found: u16::from(found) }) }
    }

    async fn set_up(&mut self) -> Result<Trim, ChipError<R::Error>> {
        // A measurement has to fit into the period.
        if self.config.preset.duration() > self.config.rate.period() {
            return Err(ChipError::InvalidConfiguration);
        }
        self.wake().await?;
        let trim = Trim::decode(&self.port.read_twice(register::TRIM).await?).ok_or(ChipError::Data)?;
        let [xy, z] = self.config.preset.codes();
        self.port.write(register::REPETITIONS_XY, &[xy]).await?;
        self.port.write(register::REPETITIONS_Z, &[z]).await?;
        self.port.write(register::MODE, &[codec::mode_bits(&self.config)]).await?;
        self.due = self.port.now() + self.config.preset.duration();
        self.trim = Some(trim);
        Ok(trim)
    }

    /// Waits for new data. Returns it with the time of the read that found it.
    async fn reading(&mut self) -> Result<(Instant, Reading), ChipError<R::Error>> {
        let period = self.config.rate.period();
        let asked = self.port.now();
        let deadline = asked + period + period;
        // Data that may have been ready for some time has an unknown age: discard it and wait for
        // the next sample.
        let mut stale = asked > self.due + period / 8;
        self.port.wait_until(self.due).await;
        loop {
            let looks = self.port.now();
            let reading = Reading::decode(&self.port.read(register::DATA_X_LSB).await?);
            let now = self.port.now();
            // Power and mode are part of every burst, so a restart is detected at once.
            if reading.power & codec::POWER_ON == 0 || reading.mode != codec::mode_bits(&self.config) {
                self.trim = None;
                return Err(ChipError::Restarted);
            }
            if reading.ready && !stale {
                // Slightly early, because the chip's clock may be fast by a few per cent.
                self.due = now + period - period / 16;
                return Ok((now, reading));
            }
            stale = false;
            if looks > deadline {
                self.trim = None;
                return Err(ChipError::NoSample);
            }
            self.port.wait(POLL).await;
        }
    }
}

impl<R: Registers, T: Timebase> Magnetometer for Bmm150<R, T> {
    type Error = ChipError<R::Error>;

    async fn next(&mut self) -> Result<Sample<MagData>, Self::Error> {
        let trim = match self.trim {
            Some(trim) => trim,
            None => self.set_up().await?,
        };
        let (seen, reading) = self.reading().await?;
        let field = trim.compensate(&reading).ok_or(ChipError::Data)?;
        // The data was ready at the end of the measurement.
        let at = seen - self.config.preset.duration() / 2;
        Ok(Sample { at, data: MagData { field: self.axes.to_body(field) } })
    }
}
