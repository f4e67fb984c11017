#![doc = include_str!("../README.md")]
#![no_std]

pub mod codec;
mod config;

use codec::register;
pub use config::{Average, Channel, Config, ConversionTime};
use embedded_hal_async::i2c::I2c;
#[cfg(feature = "embassy-time")]
pub use stampfly_driver_core::EmbassyClock;
use stampfly_driver_core::chip::Port;
pub use stampfly_driver_core::chip::{ChipError, I2cRegisters, TransferLimit};
pub use stampfly_driver_core::{PowerMonitor, Sample, Timebase};
pub use stampfly_driver_core::{SensorError, SensorErrorKind, blocking, embedded_hal, embedded_hal_async};
pub use stampfly_types::messages::PowerData;
pub use stampfly_types::{Duration, Instant};

/// Time from a reset to the first access. The data sheet does not specify it.
const AFTER_RESET: Duration = Duration::from_millis(1);
/// Pause between two reads of the flag while a result is expected.
const POLL: Duration = Duration::from_millis(2);
/// Time limit of the single conversion of the self test, which takes 2.2 ms.
const SELF_TEST_LIMIT: Duration = Duration::from_millis(10);

/// The driver. Implements [`PowerMonitor`].
///
/// `Sample::at` is the middle of the averaging time. The resolution of 40 µV corresponds to 4 mA at
/// 0.01 Ω, the range to ±16 A. The chip stores only its newest result and not its time, so a late
/// caller gets the following result. `next` returns within two averaging times and 20 ms.
///
/// ```
/// # use stampfly_driver_fakes::memory::{Chip, Clock};
/// # let (bus, clock) = (Chip::new(&[
/// #     (0xFE, &[0x54, 0x49]), (0xFF, &[0x32, 0x20]), (0x0F, &[0, 1]), (3, &[0, 200]), (4, &[0x0F, 0xA0]),
/// # ]), Clock::default());
/// use stampfly_ina3221::{Config, Ina3221, PowerMonitor, blocking::block_on};
///
/// let mut battery = Ina3221::new(bus, Ina3221::A0_GROUND, clock, Config::default());
/// let sample = block_on(battery.next()).expect("a result");
/// assert_eq!(sample.data.voltage, 4.0);
/// assert!((sample.data.current - 0.1).abs() < 1e-6);
/// ```
#[derive(Debug)]
pub struct Ina3221<R, T> {
    port: Port<R, T>,
    config: Config,
    running: bool,
    /// Earliest time of the next result.
    due: Instant,
}

impl Ina3221<(), ()> {
    /// Address with A0 connected to ground, as on the StampFly.
    pub const A0_GROUND: u8 = 0x40;
}

impl<I: I2c, T: Timebase> Ina3221<I2cRegisters<I>, T> {
    /// A driver of the chip with this address.
    pub const fn new(bus: I, address: u8, clock: T, config: Config) -> Self {
        let port = Port::new(I2cRegisters::new(bus, address), clock, TransferLimit::I2C);
        Self { port, config, running: false, due: Instant::ZERO }
    }

    /// Sets the chip up: identification, reset, configuration. Takes one millisecond.
    ///
    /// # Errors
    /// [`ChipError::Identification`], [`ChipError::InvalidConfiguration`] for an invalid shunt or
    /// none on [`Config::channel`], and errors of the bus.
    pub async fn start(&mut self) -> Result<(), ChipError<I::Error>> {
        self.running = false;
        let can_be = |ohms: f32| ohms.is_finite() && ohms > 0.0;
        let measured = self.config.shunt(self.config.channel).is_some();
        if !(measured && self.config.shunts_ohms.into_iter().flatten().all(can_be)) {
            return Err(ChipError::InvalidConfiguration);
        }
        for (register, value) in
            [(register::MANUFACTURER, codec::MANUFACTURER_VALUE), (register::DIE, codec::DIE_VALUE)]
        {
            let found = self.read(register).await?;
            if found != value {
                return Err(ChipError::Identification { found });
            }
        }
        self.write(codec::RESET).await?;
        self.port.wait(AFTER_RESET).await;
        self.write(codec::configuration(&self.config)).await?;
        self.due = self.port.now() + codec::cycle(&self.config);
        self.running = true;
        Ok(())
    }

    /// Sets the chip up, checks that it keeps its settings, and makes one conversion, independent
    /// of the averaging. 6 ms, 2.2 ms more for every further channel, at most 0.2 s on a slow bus
    /// with [`TransferLimit::I2C_SENSORS`].
    ///
    /// The chip has no self test of its own: this one checks for a supply on the configured channel
    /// and a shunt voltage within the scale. 0 V fails, because a missing battery, a shunt on
    /// another channel and a faulty converter cannot be distinguished. The next call sets the chip
    /// up again.
    ///
    /// # Errors
    /// Those of [`start`](Self::start); [`ChipError::Configuration`] when the settings were not
    /// kept, with the upper byte of the value read back; [`ChipError::NoSample`] without a
    /// conversion; [`ChipError::SelfTest`] for a supply that is not above 0 V or exceeds 26 V, or a
    /// shunt voltage beyond the scale of ±163.8 mV, as with an open shunt.
    pub async fn self_test(&mut self) -> Result<(), ChipError<I::Error>> {
        self.start().await?;
        self.running = false;
        let config = self.config;
        self.keeps(&config).await?;
        // A single conversion, because the configured averaging may take seconds.
        let single = Config { average: Average::A1, time: ConversionTime::Us1100, ..config };
        self.write(codec::configuration(&single)).await?;
        self.keeps(&single).await?;
        let deadline = self.port.now() + SELF_TEST_LIMIT;
        loop {
            let looks = self.port.now();
            if self.read(register::MASK_ENABLE).await? & codec::CONVERSION_READY != 0 {
                break;
            }
            if looks > deadline {
                return Err(ChipError::NoSample);
            }
            self.port.wait(POLL).await;
        }
        let shunt = self.read(config.channel.shunt_register()).await?;
        let bus = self.read(config.channel.bus_register()).await?;
        if codec::is_measurable(shunt, bus) { Ok(()) } else { Err(ChipError::SelfTest) }
    }

    /// The next result of every channel that has a shunt, in the chip's order. Each result is
    /// returned once, either by this method or by [`next`](PowerMonitor::next).
    ///
    /// # Errors
    /// Those of [`start`](Self::start) and [`next`](PowerMonitor::next).
    pub async fn next_of_all(&mut self) -> Result<Sample<[Option<PowerData>; 3]>, ChipError<I::Error>> {
        let at = self.ready().await?;
        let mut data = [None; 3];
        for (place, channel) in data.iter_mut().zip(Channel::ALL) {
            if let Some(ohms) = self.config.shunt(channel) {
                *place = Some(self.measured(channel, ohms).await?);
            }
        }
        Ok(Sample { at, data })
    }

    stampfly_driver_core::transfer_limit!();

    /// Takes the driver apart and returns the bus and the clock. The chip continues to measure.
    pub fn release(self) -> (I, T) {
        self.port.release()
    }

    /// Reads the result of a channel.
    async fn measured(&mut self, channel: Channel, shunt_ohms: f32) -> Result<PowerData, ChipError<I::Error>> {
        let current = codec::shunt_volts(self.read(channel.shunt_register()).await?) / shunt_ohms;
        let voltage = codec::bus_volts(self.read(channel.bus_register()).await?);
        Ok(PowerData { voltage, current, power: voltage * current })
    }

    /// Checks that the chip holds this configuration.
    async fn keeps(&mut self, config: &Config) -> Result<(), ChipError<I::Error>> {
        let kept = self.read(register::CONFIGURATION).await?;
        let [status, _] = kept.to_be_bytes();
        if kept == codec::configuration(config) { Ok(()) } else { Err(ChipError::Configuration { status }) }
    }

    async fn read(&mut self, register: u8) -> Result<u16, ChipError<I::Error>> {
        Ok(u16::from_be_bytes(self.port.read(register).await?))
    }

    async fn write(&mut self, configuration: u16) -> Result<(), ChipError<I::Error>> {
        self.port.write(register::CONFIGURATION, &configuration.to_be_bytes()).await
    }

    /// Starts the chip if necessary, waits for a result, and returns the middle of its averaging
    /// time.
    async fn ready(&mut self) -> Result<Instant, ChipError<I::Error>> {
        if !self.running {
            self.start().await?;
        }
        let cycle = codec::cycle(&self.config);
        let asked = self.port.now();
        let deadline = asked + cycle + cycle;
        // A flag that may have been set for some time does not show when: clear it and wait for the
        // next.
        let mut stale = asked > self.due + cycle / 8;
        self.port.wait_until(self.due).await;
        loop {
            let looks = self.port.now();
            // A chip that restarted measures all channels with other timing.
            if self.read(register::CONFIGURATION).await? != codec::configuration(&self.config) {
                self.running = false;
                return Err(ChipError::Restarted);
            }
            let flags = self.read(register::MASK_ENABLE).await?;
            let now = self.port.now();
            if flags & codec::CONVERSION_READY != 0 && !stale {
                // Slightly early, because the chip's clock may be fast by a few per cent.
                self.due = now + cycle - cycle / 16;
                return Ok(now - cycle / 2);
            }
            stale = false;
            if looks > deadline {
                self.running = false;
                return Err(ChipError::NoSample);
            }
            self.port.wait(POLL).await;
        }
    }
}

impl<I: I2c, T: Timebase> PowerMonitor for Ina3221<I2cRegisters<I>, T> {
    type Error = ChipError<I::Error>;

    async fn next(&mut self) -> Result<Sample<PowerData>, Self::Error> {
        let at = self.ready().await?;
        let channel = self.config.channel;
        // `start` refuses a channel without a shunt.
        let shunt = self.config.shunt(channel).ok_or(ChipError::InvalidConfiguration)?;
        Ok(Sample { at, data: self.measured(channel, shunt).await? })
    }
}
