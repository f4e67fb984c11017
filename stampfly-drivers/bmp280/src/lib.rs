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

/// From reset to the first access, §1 table 2.
const START_UP: Duration = Duration::from_millis(2);
/// How long the chip may copy its calibration.
const COPY_LIMIT: Duration = Duration::from_millis(20);
/// How often a conversion may not start, as far as can be seen, before the chip counts as broken.
const ATTEMPTS: usize = 2;
/// How often it is started in all: where neighbours fill the bus, the look at it may come when it is over, and tells nothing.
const STARTS: usize = 16;
const POLL: Duration = Duration::from_millis(1);
/// What the chip can measure, Pa with eight bits after the point, §1 table 2.
const RANGE: core::ops::RangeInclusive<u32> = 30_000 << 8..=110_000 << 8;
/// Where it works, hundredths of a degree Celsius, §1 table 2.
const WORKS_AT: core::ops::RangeInclusive<i32> = -4_000..=8_500;

/// The driver. Implements [`Barometer`].
///
/// `Sample::at` is the middle of the pressure conversion; the filter's delay of a few samples is not taken off. A call
/// that is dropped loses its conversion, and the next one starts another when that one is over. The driver asks whether a
/// conversion has really started, so none is delivered twice. Pressures
/// outside of what the chip can measure are [`ChipError::Data`]. `next` ends within an interval and two conversions, 30 ms
/// later when it sets the chip up.
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
    /// `None` while the chip is not set up.
    calibration: Option<Calibration>,
    /// When the next conversion may begin.
    due: Instant,
}

impl Bmp280<(), ()> {
    /// Address with SDO at ground, as on the StampFly.
    pub const SDO_LOW: u8 = 0x76;
    /// Address with SDO at the supply.
    pub const SDO_HIGH: u8 = 0x77;
}

impl<I: I2c, T: Timebase> Bmp280<I2cRegisters<I>, T> {
    /// The chip with this address, its CSB at the supply.
    pub const fn i2c(bus: I, address: u8, clock: T, config: Config) -> Self {
        Self::new(I2cRegisters::new(bus, address), clock, config)
    }
}

impl<S: SpiDevice, T: Timebase> Bmp280<SpiRegisters<S, 0>, T> {
    /// The chip on SPI of four wires, mode 0 or 3, up to 10 MHz.
    ///
    /// From the first time that its CSB is low the chip is deaf on I2C, until it loses its power (§5.1).
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
    /// Another chip, one without calibration, the bus.
    pub async fn start(&mut self) -> Result<(), ChipError<R::Error>> {
        self.set_up().await.map(|_| ())
    }

    /// Sets the chip up, has it keep its settings and make one conversion. 20 ms by default, within 0.4 s however slow the
    /// bus, with [`TransferLimit::I2C_SENSORS`]; an oversampling of 16 adds 60 ms.
    ///
    /// The chip has no self test of its own: this one asks whether pressure and temperature are what it can measure at all.
    /// Afterwards the chip is set up, and the next sample comes in its rhythm.
    ///
    /// # Errors
    /// Those of [`start`](Self::start), among them [`ChipError::Data`] for a calibration that cannot be;
    /// [`ChipError::Configuration`] for a setting that was not kept, with what is there instead;
    /// [`ChipError::NoSample`] without a conversion; [`ChipError::SelfTest`] for one that measured nothing, or something
    /// outside of 300 to 1100 hPa and −40 to 85 °C (§1).
    pub async fn self_test(&mut self) -> Result<(), ChipError<R::Error>> {
        let calibration = self.set_up().await?;
        let wanted = [codec::oversampling_bits(&self.config), codec::filter_bits(&self.config)];
        let [oversampling, _] = wanted;
        // Without a mode: asleep.
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

    /// Starts a conversion, and gives the instant.
    ///
    /// Without one the data registers hold the conversion before, and nothing tells the two apart.
    async fn begin(&mut self) -> Result<Instant, ChipError<R::Error>> {
        let limit = codec::conversion_limit(&self.config);
        let mut failed = 0;
        for _ in 0..STARTS {
            self.due = self.port.now() + self.config.interval.max(limit);
            let control = codec::oversampling_bits(&self.config) | codec::FORCED;
            self.port.write(register::CTRL_MEAS, &[control]).await?;
            // Not before the write: that may have waited for the bus.
            let begun = self.port.now();
            let [status, mode]: [u8; 2] = self.port.read(register::STATUS).await?;
            if status & codec::MEASURING != 0 || mode & codec::MODE != 0 {
                return Ok(begun);
            }
            failed += usize::from(self.port.now().since(begun) < limit / 2);
            if failed == ATTEMPTS {
                break;
            }
        }
        self.calibration = None;
        Err(ChipError::NoSample)
    }

    /// The raw result of the conversion that began at this instant.
    async fn finish(&mut self, begun: Instant) -> Result<Reading, ChipError<R::Error>> {
        let wanted = (codec::oversampling_bits(&self.config), codec::filter_bits(&self.config));
        let limit = codec::conversion_limit(&self.config);
        self.port.wait_until(begun + limit).await;
        loop {
            let looks = self.port.now();
            let reading = Reading::decode(&self.port.read(register::STATUS).await?);
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
