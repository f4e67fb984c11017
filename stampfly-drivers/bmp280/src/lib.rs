#![doc = include_str!("../README.md")]
#![no_std]

pub mod codec;
mod config;

use codec::{Calibration, Reading, register};
pub use config::{Config, Filter, Oversampling};
use embedded_hal_async::i2c::I2c;
use embedded_hal_async::spi::SpiDevice;
#[cfg(feature = "embassy-time")]
pub use stampfly_driver_core::EmbassyClock;
use stampfly_driver_core::chip::Port;
pub use stampfly_driver_core::chip::{ChipError, I2cRegisters, Registers, SpiRegisters, TransferLimit, Wires};
pub use stampfly_driver_core::{Barometer, Sample, Timebase};
pub use stampfly_driver_core::{SensorError, SensorErrorKind, blocking, embedded_hal, embedded_hal_async};
pub use stampfly_types::messages::BaroData;
pub use stampfly_types::{Duration, Instant};

/// Time from a reset to the first access, §1 table 2.
const START_UP: Duration = Duration::from_millis(2);
/// Time limit for the chip to copy its calibration.
const COPY_LIMIT: Duration = Duration::from_millis(20);
/// Number of conversions that do not start before the chip counts as faulty.
const ATTEMPTS: usize = 2;
/// Number of attempts in total. On a busy bus the check may come after the end of the conversion,
/// and then shows nothing.
const STARTS: usize = 16;
const POLL: Duration = Duration::from_millis(1);
/// Range of the chip, Pa with eight fractional bits, §1 table 2.
const RANGE: core::ops::RangeInclusive<u32> = 30_000 << 8..=110_000 << 8;
/// Operating temperature of the chip, hundredths of a degree Celsius, §1 table 2.
const WORKS_AT: core::ops::RangeInclusive<i32> = -4_000..=8_500;

/// The driver. Implements [`Barometer`].
///
/// `Sample::at` is the middle of the pressure conversion; the filter's delay of a few samples is
/// not subtracted. A call that is dropped loses its conversion, and the next call starts another
/// one after its end. The driver checks that each conversion has started, so none is delivered
/// twice. A pressure out of the chip's range is [`ChipError::Data`]. `next` returns within an
/// interval and two conversions, 30 ms later when it sets the chip up.
///
/// ```
/// # use stampfly_driver_fakes::memory::{Chip, Clock};
/// # let calibration: Vec<u8> = [27504, 26435, -1000, 36477, -10685, 3024, 2855, 140, -7, 15500, -14600, 6000]
/// #     .into_iter().flat_map(|word: i32| (word as u16).to_le_bytes()).collect();
/// # let (bus, clock) = (Chip::new(&[
/// #     (0x88, &calibration), (0xD0, &[0x58]), (0xF7, &[0x65, 0x5A, 0xC0, 0x7E, 0xED, 0x00]),
/// # ]), Clock::default());
/// use stampfly_bmp280::{Barometer, Bmp280, Config, blocking::block_on};
///
/// let mut baro = Bmp280::i2c(bus, Bmp280::SDO_LOW, clock, Config::default());
/// let sample = block_on(baro.next()).expect("a conversion");
/// assert_eq!(sample.data.pressure.round(), 100_653.0);
/// ```
#[derive(Debug)]
pub struct Bmp280<R, T> {
    port: Port<R, T>,
    config: Config,
    /// Calibration of the chip; `None` until it is set up.
    calibration: Option<Calibration>,
    /// Earliest start of the next conversion.
    due: Instant,
}

impl Bmp280<(), ()> {
    /// Address with SDO connected to ground, as on the StampFly.
    pub const SDO_LOW: u8 = 0x76;
    /// Address with SDO at the supply voltage.
    pub const SDO_HIGH: u8 = 0x77;
}

impl<I: I2c, T: Timebase> Bmp280<I2cRegisters<I>, T> {
    /// The chip with this address on I2C, with its pin CSB at the supply voltage.
    pub const fn i2c(bus: I, address: u8, clock: T, config: Config) -> Self {
        Self::new(I2cRegisters::new(bus, address), clock, config)
    }
}

impl<S: SpiDevice, T: Timebase> Bmp280<SpiRegisters<S, 0>, T> {
    /// The chip on four-wire SPI, mode 0 or 3, up to 10 MHz.
    ///
    /// The first low level on CSB disables the chip's I2C interface until it loses its power
    /// (§5.1).
    pub const fn spi(device: S, clock: T, config: Config) -> Self {
        Self::new(SpiRegisters(device), clock, config)
    }
}

impl<R: Registers, T: Timebase> Bmp280<R, T> {
    const fn new(registers: R, clock: T, config: Config) -> Self {
        Self { port: Port::new(registers, clock, R::LIMIT), config, calibration: None, due: Instant::ZERO }
    }

    stampfly_driver_core::transfer_limit!();

    stampfly_driver_core::release!();

    /// Sets the chip up: reset, identification, calibration, filter. A few milliseconds.
    ///
    /// # Errors
    /// [`ChipError::Identification`], [`ChipError::Data`] for a missing calibration, and errors of
    /// the bus.
    pub async fn start(&mut self) -> Result<(), ChipError<R::Error>> {
        self.set_up().await.map(|_| ())
    }

    /// Sets the chip up, checks that it keeps its settings, and makes one conversion. 20 ms by
    /// default, at most 0.4 s on a slow bus with [`TransferLimit::I2C_SENSORS`]; 60 ms more with an
    /// oversampling of 16.
    ///
    /// The chip has no self test of its own: this one checks that pressure and temperature are in
    /// its range. The chip is set up afterwards, and the next sample follows after the interval.
    ///
    /// # Errors
    /// Those of [`start`](Self::start), including [`ChipError::Data`] for an invalid calibration;
    /// [`ChipError::Configuration`] for a setting that was not kept, with the value read back;
    /// [`ChipError::NoSample`] without a conversion; [`ChipError::SelfTest`] for an empty result or
    /// one outside 300 to 1100 hPa and −40 to 85 °C (§1).
    pub async fn self_test(&mut self) -> Result<(), ChipError<R::Error>> {
        let calibration = self.set_up().await?;
        let wanted = [codec::oversampling_bits(&self.config), codec::filter_bits(&self.config)];
        let [oversampling, _] = wanted;
        // Without a mode the chip stays asleep.
        self.port.write(register::CTRL_MEAS, &[oversampling]).await?;
        let kept: [u8; 2] = self.port.read(register::CTRL_MEAS).await?;
        for (wanted, status) in wanted.into_iter().zip(kept) {
            if status != wanted {
                self.calibration = None;
                return Err(ChipError::Configuration { status });
            }
        }
        let begun = self.begin().await?;
        let reading = self.finish(begun).await?;
        if reading.pressure == Reading::SKIPPED || reading.temperature == Reading::SKIPPED {
            return Err(ChipError::SelfTest);
        }
        match calibration.compensate(reading.temperature, reading.pressure) {
            Some(measured) if RANGE.contains(&measured.pressure) && WORKS_AT.contains(&measured.temperature) => Ok(()),
            _ => Err(ChipError::SelfTest),
        }
    }

    async fn set_up(&mut self) -> Result<Calibration, ChipError<R::Error>> {
        self.calibration = None;
        let [found]: [u8; 1] = self.port.read(register::ID).await?;
        if !codec::IDENTIFICATIONS.contains(&found) {
            return Err(ChipError::Identification { found: u16::from(found) });
        }
        self.port.write(register::RESET, &[codec::SOFT_RESET]).await?;
        self.port.wait(START_UP).await;
        let deadline = self.port.now() + COPY_LIMIT;
        loop {
            let looks = self.port.now();
            let [status]: [u8; 1] = self.port.read(register::STATUS).await?;
            if status & codec::COPYING == 0 {
                break;
            }
            if looks > deadline {
                return Err(ChipError::Configuration { status });
            }
            self.port.wait(POLL).await;
        }
        let bytes = self.port.read_twice(register::CALIBRATION).await?;
        let calibration = Calibration::decode(&bytes).ok_or(ChipError::Data)?;
        self.port.write(register::CONFIG, &[codec::filter_bits(&self.config)]).await?;
        self.calibration = Some(calibration);
        self.due = self.port.now();
        Ok(calibration)
    }

    /// Starts a conversion and returns the time of the start.
    ///
    /// If it did not start, the data registers would still hold the previous conversion, which
    /// looks the same as a new one.
    async fn begin(&mut self) -> Result<Instant, ChipError<R::Error>> {
        let limit = codec::conversion_limit(&self.config);
        let mut failed = 0;
        for _ in 0..STARTS {
            // Set before the write, so that time spent waiting for the bus does not lengthen the
            // interval.
            self.due = self.port.now() + self.config.interval.max(limit);
            let control = codec::oversampling_bits(&self.config) | codec::FORCED;
            self.port.write(register::CTRL_MEAS, &[control]).await?;
            // Read after the write, which may have waited for the bus.
            let begun = self.port.now();
            let [status, mode]: [u8; 2] = self.port.read(register::STATUS).await?;
            if status & codec::MEASURING != 0 || mode & codec::MODE != 0 {
                return Ok(begun);
            }
            // The check counts only if the conversion cannot have ended already.
            failed += usize::from(self.port.now().since(begun) < limit / 2);
            if failed == ATTEMPTS {
                break;
            }
        }
        self.calibration = None;
        Err(ChipError::NoSample)
    }

    /// The raw result of the conversion that started at this instant.
    async fn finish(&mut self, begun: Instant) -> Result<Reading, ChipError<R::Error>> {
        let wanted = (codec::oversampling_bits(&self.config), codec::filter_bits(&self.config));
        let limit = codec::conversion_limit(&self.config);
        self.port.wait_until(begun + limit).await;
        loop {
            let looks = self.port.now();
            let reading = Reading::decode(&self.port.read(register::STATUS).await?);
            // The settings are part of the burst, so a restart is detected at once.
            if (reading.oversampling_bits, reading.filter_bits) != wanted {
                self.calibration = None;
                return Err(ChipError::Restarted);
            }
            if !reading.measuring {
                return Ok(reading);
            }
            if looks > begun + limit + limit {
                self.calibration = None;
                return Err(ChipError::NoSample);
            }
            self.port.wait(POLL).await;
        }
    }
}

impl<R: Registers, T: Timebase> Barometer for Bmp280<R, T> {
    type Error = ChipError<R::Error>;

    async fn next(&mut self) -> Result<Sample<BaroData>, Self::Error> {
        let calibration = match self.calibration {
            Some(calibration) => calibration,
            None => self.set_up().await?,
        };
        self.port.wait_until(self.due).await;
        let begun = self.begin().await?;
        let reading = self.finish(begun).await?;
        if reading.pressure == Reading::SKIPPED || reading.temperature == Reading::SKIPPED {
            return Err(ChipError::Data);
        }
        let compensated = calibration
            .compensate(reading.temperature, reading.pressure)
            .filter(|compensated| RANGE.contains(&compensated.pressure))
            .ok_or(ChipError::Data)?;
        let pressure = compensated.pressure as f32 / 256.0;
        let data = BaroData {
            pressure,
            temperature: compensated.temperature as f32 / 100.0,
            altitude: codec::pressure_altitude(pressure),
        };
        Ok(Sample { at: begun + codec::pressure_instant(&self.config), data })
    }
}
