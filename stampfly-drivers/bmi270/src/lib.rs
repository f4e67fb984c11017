#![doc = include_str!("../README.md")]
#![no_std]

pub mod codec;
mod config;
mod interrupt;
mod peak;

use codec::{FRAME_BYTES, Status, register};
pub use config::{AccelRange, Config, GyroRange, Rate};
use embedded_hal_async::digital::Wait;
use embedded_hal_async::i2c::I2c;
use embedded_hal_async::spi::SpiDevice;
use interrupt::Interrupt;
pub use interrupt::NoPin;
pub use peak::Peak;
use stampfly_driver_core::Decimator;
#[cfg(feature = "embassy-time")]
pub use stampfly_driver_core::EmbassyClock;
use stampfly_driver_core::chip::Port;
pub use stampfly_driver_core::chip::{
    Axis, AxisMap, ChipError, I2cRegisters, Registers, SpiRegisters, TransferLimit, Wires,
};
pub use stampfly_driver_core::{Imu, Sample, Timebase};
pub use stampfly_driver_core::{SensorError, SensorErrorKind, blocking, embedded_hal, embedded_hal_async};
pub use stampfly_types::messages::ImuData;
pub use stampfly_types::{Duration, Instant};
use stampfly_types::{GRAVITY, Vec3};

/// The chip may be accessed this long after power-on and after leaving power saving (§4 "Start-up").
const POWER_UP: Duration = Duration::from_micros(450);
/// Idle time after a write in normal mode, "Interface" and timing tables of the data sheet.
const AFTER_WRITE: Duration = Duration::from_micros(2);
const SOFT_RESET: Duration = Duration::from_micros(2_000);
/// How long the chip may take to start with its configuration: typically 20 ms.
const START_UP_LIMIT: Duration = Duration::from_millis(150);
/// The gyroscope's first sample after it is switched on, 45 ms (§1.2), with a margin.
const GYRO_START: Duration = Duration::from_millis(50);
/// Each deflection of the self test settles for 50 ms (§4 "Sensor self-test").
const SELF_TEST_SETTLE: Duration = Duration::from_millis(51);
/// How long the gyroscope's self test may take. The data sheet gives no figure; Bosch's sensor API waits as long.
const GYRO_SELF_TEST_LIMIT: Duration = Duration::from_secs(2);
/// From the accelerometer on to the selection of the test, as in Bosch's sensor API.
const BEFORE_GYRO_SELF_TEST: Duration = Duration::from_millis(1);
/// Ticks of sensor time from a sample to the read the driver aims at, and to the earliest one it trusts: before, the
/// FIFO may or may not hold the sample.
const AIM: u64 = 3;
const EARLIEST: u64 = 2;
/// The FIFO of 2 kB holds 157 frames; from here on it may have lost some before the driver could look.
const OVERRUN: u64 = 150;
/// How often in a row a look may come when it tells nothing, because the bus was somebody else's meanwhile.
const DOUBTS: u32 = 32;
/// Samples may be missing for this many output periods.
const PATIENCE: u64 = 4;

/// The driver. Implements [`Imu`].
///
/// `Sample::at` is the middle of the decimation filter: at 400 Hz three chip samples (1.9 ms) before the newest one,
/// by the chip's clock, good to one of its ticks (39 µs) and the time that the address takes on the bus (4 µs on SPI at
/// 10 MHz, 0.1 ms on I2C at 400 kHz). The chip's own low-pass delays a little more; that is not taken off.
///
/// A reader that comes late gets every sample, up to 90 ms (at 400 Hz), each stamped by the nominal rate: off by what
/// the chip's clock is in the time it was late, 2 % of it. Beyond that, or when the FIFO holds something else than
/// samples, it is emptied and the filter starts anew, which takes two output periods. After a read that failed or was
/// cancelled the filter starts anew with what the FIFO still holds. Gives up on the chip ([`ChipError::NoSample`]) after
/// four output periods without a sample.
///
/// One wrong bit on the bus costs no sample, wherever it is: a status that cannot be is read again before the chip
/// counts as restarted, and a frame's header may have one. What it does to a measured value cannot be known.
///
/// [`with_interrupt`](Self::with_interrupt) takes the pin that INT1 is wired to (GPIO 11 on the StampFly).
///
/// The chip does not run without a configuration of 8 kB that Bosch publishes with its sensor API
/// (`bmi270_config_file`); it is not part of this crate.
///
/// ```
/// # use stampfly_driver_fakes::memory::{Chip, Clock};
/// # let frames = [0x8C, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xF0].repeat(4);
/// # let (device, clock) = (Chip::new(&[
/// #     (0x00, &[0x24]), (0x21, &[0x01]), (0x26, &frames), (0x18, &[3, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 52, 0]),
/// # ]), Clock::default());
/// # let configuration_file = [0xC8; 8_192];
/// use stampfly_bmi270::{AxisMap, Bmi270, Config, Imu, blocking::block_on};
///
/// let mut imu = Bmi270::spi(device, clock, &configuration_file, AxisMap::IDENTITY, Config::default());
/// let sample = block_on(imu.next()).expect("a sample");
/// assert!((sample.data.accel.z + 9.81).abs() < 0.01, "level and still");
/// ```
#[derive(Debug)]
pub struct Bmi270<'b, R, T, P = NoPin> {
    port: Port<R, T>,
    interrupt: Interrupt<P>,
    blob: &'b [u8],
    axes: AxisMap,
    config: Config,
    running: bool,
    /// Between the first bit of a FIFO read and its last: set when a call was cancelled there.
    reading: bool,
    decimator: Decimator,
    peak: Peak,
    /// When to look again.
    due: Instant,
    /// The shortest time a status took: the bus alone, without waiting for it.
    on_bus: Duration,
    cross_axis: f32,
    temperature: f32,
}

impl<'b, S: SpiDevice, T: Timebase> Bmi270<'b, SpiRegisters<S>, T> {
    /// The chip on SPI, mode 0 or 3, up to 10 MHz.
    pub fn spi(device: S, clock: T, blob: &'b [u8], axes: AxisMap, config: Config) -> Self {
        Self::new(SpiRegisters(device), clock, blob, axes, config)
    }
}

impl<'b, I: I2c, T: Timebase> Bmi270<'b, I2cRegisters<I>, T> {
    /// The chip on I2C, at 0x68 (SDO low) or 0x69. The read of a sample fills a 400 kHz bus for 1.7 ms.
    pub fn i2c(bus: I, address: u8, clock: T, blob: &'b [u8], axes: AxisMap, config: Config) -> Self {
        Self::new(I2cRegisters::new(bus, address), clock, blob, axes, config)
    }
}

impl<R: Wires, T, P> Bmi270<'_, R, T, P> {
    stampfly_driver_core::transfer_limit!();

    /// Takes the driver apart: the bus or device, the clock, and the interrupt's pin, if it has one. The chip goes on measuring.
    pub fn release(self) -> (R::Bus, T, Option<P>) {
        let (wires, clock) = self.port.release();
        (wires, clock, self.interrupt.release())
    }
}

impl<'b, R: Registers, T: Timebase> Bmi270<'b, R, T> {
    fn new(registers: R, clock: T, blob: &'b [u8], axes: AxisMap, config: Config) -> Self {
        Self {
            port: Port::new(registers, clock, R::LIMIT),
            interrupt: Interrupt::none(),
            blob,
            axes,
            config,
            running: false,
            reading: false,
            decimator: Decimator::default(),
            peak: Peak::default(),
            due: Instant::ZERO,
            on_bus: Duration::from_secs(1),
            cross_axis: 0.0,
            // The zero of the chip's scale, until it has measured.
            temperature: 23.0,
        }
    }

    /// The same chip, with the pin its INT1 is wired to. The chip drives it, high when four samples are there.
    pub fn with_interrupt<P: Wait>(self, pin: P) -> Bmi270<'b, R, T, P> {
        let Self { port, blob, axes, config, reading, decimator, peak, due, on_bus, cross_axis, temperature, .. } =
            self;
        let interrupt = Interrupt::on(pin);
        // It is set up anew, with the interrupt.
        Bmi270 {
            port,
            interrupt,
            blob,
            axes,
            config,
            running: false,
            reading,
            decimator,
            peak,
            due,
            on_bus,
            cross_axis,
            temperature,
        }
    }
}

impl<R: Registers, T: Timebase, P: Wait> Bmi270<'_, R, T, P> {
    /// Sets the chip up: reset, identification, configuration file, sensors, FIFO. 60 to 220 ms.
    ///
    /// # Errors
    /// Another chip, an impossible or refused configuration, the bus.
    pub async fn start(&mut self) -> Result<(), ChipError<R::Error>> {
        self.running = false;
        self.upload().await?;
        let wanted = codec::sensor_registers(&self.config);
        self.write(register::ACC_CONF, &wanted).await?;
        self.write(register::FIFO_DOWNS, &[codec::FIFO_FILTERED]).await?;
        self.write(register::FIFO_CONFIG_0, &codec::FIFO_WITH_HEADERS).await?;
        if self.interrupt.is_wired() {
            self.write(register::FIFO_WTM_0, &codec::WATERMARK).await?;
            self.write(register::INT1_IO_CTRL, &[codec::INT1_PUSH_PULL_HIGH]).await?;
            self.write(register::INT_LATCH, &[codec::NOT_LATCHED]).await?;
            self.write(register::INT_MAP_DATA, &[codec::WATERMARK_ON_INT1]).await?;
            self.interrupt.trust();
        }
        self.write(register::PWR_CTRL, &[codec::ALL_SENSORS]).await?;
        self.write(register::PWR_CONF, &[codec::NORMAL_POWER]).await?;
        self.port.wait(GYRO_START).await;
        let kept: [u8; 4] = self.port.read(register::ACC_CONF).await?;
        let (status, ..) = self.status().await?;
        if kept != wanted || status.configuration_error {
            return Err(ChipError::Configuration { status: kept[0] });
        }
        self.temperature = status.celsius().unwrap_or(self.temperature);
        let [factor]: [u8; 1] = self.port.read_twice(register::GYR_CAS).await?;
        self.cross_axis = f32::from(codec::cross_axis_factor(factor)) / 512.0;
        self.restart_fifo().await?;
        self.running = true;
        Ok(())
    }

    /// Deflects the accelerometer's masses both ways and compares. 170 ms; the vehicle has to stand still.
    ///
    /// Leaves the chip to be set up by the next call.
    ///
    /// # Errors
    /// [`ChipError::SelfTest`], and those of [`start`](Self::start).
    pub async fn self_test(&mut self) -> Result<(), ChipError<R::Error>> {
        self.running = false;
        self.upload().await?;
        self.write(register::PWR_CONF, &[codec::NORMAL_POWER]).await?;
        self.write(register::PWR_CTRL, &[codec::ACCELEROMETER_ONLY]).await?;
        // 1600 Hz, normal bandwidth, performance filter, ±16 g.
        self.write(register::ACC_CONF, &[0xAC, AccelRange::G16.code()]).await?;
        self.port.wait(SOFT_RESET).await;
        // High amplitude and enable; bit 2 is the direction.
        let mut deflections = [[0; 3]; 2];
        for (command, deflection) in [0x0D, 0x09].into_iter().zip(&mut deflections) {
            self.write(register::ACC_SELF_TEST, &[command]).await?;
            self.port.wait(SELF_TEST_SETTLE).await;
            *deflection = codec::decode_acceleration(&self.port.read(register::DATA_8).await?);
        }
        self.write(register::ACC_SELF_TEST, &[0]).await?;
        let [positive, negative] = deflections;
        if codec::passes_self_test(positive, negative) { Ok(()) } else { Err(ChipError::SelfTest) }
    }

    /// Lets the chip test its gyroscope's drive. The vehicle has to stand still. Given up after 2.2 s.
    ///
    /// The test is a feature of the configuration file: the short file that has the FIFO only fails it. The order is that
    /// of Bosch's sensor API; the data sheet names the registers only. **Unverified** on a chip. Leaves the chip to be set
    /// up by the next call.
    ///
    /// # Errors
    /// [`ChipError::SelfTest`], also when it does not end, and those of [`start`](Self::start).
    pub async fn gyro_self_test(&mut self) -> Result<(), ChipError<R::Error>> {
        self.running = false;
        self.upload().await?;
        self.write(register::GYR_CRT_CONF, &[codec::GYRO_TEST_RUNS]).await?;
        // The gyroscope off; the accelerometer on, which tells the test whether the vehicle stands still.
        self.write(register::PWR_CTRL, &[codec::ACCELEROMETER_ONLY]).await?;
        self.port.wait(BEFORE_GYRO_SELF_TEST).await;
        self.write(register::FEAT_PAGE, &[1]).await?;
        self.write(register::G_TRIG_1, &codec::SELECT_GYRO_SELF_TEST).await?;
        self.write(register::CMD, &[codec::GYRO_TRIGGER]).await?;
        let deadline = self.port.now() + GYRO_SELF_TEST_LIMIT;
        loop {
            self.port.wait(Duration::from_millis(1)).await;
            let looks = self.port.now();
            let [running]: [u8; 1] = self.port.read(register::GYR_CRT_CONF).await?;
            if running & codec::GYRO_TEST_RUNS == 0 {
                break;
            }
            if looks > deadline {
                return Err(ChipError::SelfTest);
            }
        }
        self.write(register::FEAT_PAGE, &[0]).await?;
        let [status]: [u8; 1] = self.port.read(register::GYR_GAIN_STATUS).await?;
        let [axes]: [u8; 1] = self.port.read(register::GYR_SELF_TEST_AXES).await?;
        let passed = codec::gyro_self_test(axes) == Some(true) && !codec::gyro_trigger_failed(status);
        if passed { Ok(()) } else { Err(ChipError::SelfTest) }
    }

    /// Reset, identification, configuration file, until the chip says it runs.
    async fn upload(&mut self) -> Result<(), ChipError<R::Error>> {
        if self.blob.is_empty() || !self.blob.len().is_multiple_of(2) || self.blob.len() > codec::BLOB_LIMIT {
            return Err(ChipError::InvalidConfiguration);
        }
        // Until the first rising edge of its chip select the chip listens as on I2C: what this read gives is noise.
        let _: [u8; 1] = self.port.read(register::CHIP_ID).await?;
        self.port.wait(POWER_UP).await;
        self.write(register::CMD, &[codec::SOFT_RESET]).await?;
        self.port.wait(SOFT_RESET).await;
        let _: [u8; 1] = self.port.read(register::CHIP_ID).await?;
        self.port.wait(POWER_UP).await;
        let [found]: [u8; 1] = self.port.read(register::CHIP_ID).await?;
        if found != codec::CHIP_ID_VALUE {
            return Err(ChipError::Identification { found: u16::from(found) });
        }
        self.write(register::PWR_CONF, &[0]).await?;
        self.port.wait(POWER_UP).await;
        self.write(register::INIT_CTRL, &[0]).await?;
        for (number, chunk) in self.blob.chunks(R::LONGEST_WRITE).enumerate() {
            self.write(register::INIT_ADDR_0, &codec::init_address(number * R::LONGEST_WRITE)).await?;
            self.write(register::INIT_DATA, chunk).await?;
        }
        self.write(register::INIT_CTRL, &[1]).await?;
        let deadline = self.port.now() + START_UP_LIMIT;
        loop {
            let looks = self.port.now();
            let [status]: [u8; 1] = self.port.read(register::INTERNAL_STATUS).await?;
            match status & 0x0F {
                Status::RUNNING => return Ok(()),
                // Not initialised yet.
                0 if looks < deadline => self.port.wait(Duration::from_millis(1)).await,
                _ => return Err(ChipError::Configuration { status }),
            }
        }
    }

    /// Writes, and leaves the chip the time it needs until the next access.
    async fn write(&mut self, register: u8, bytes: &[u8]) -> Result<(), ChipError<R::Error>> {
        self.port.write(register, bytes).await?;
        self.port.wait(AFTER_WRITE).await;
        Ok(())
    }

    /// The status, the instant of the time in it, and how long after that at most the fill level was read.
    async fn status(&mut self) -> Result<(Status, Instant, Duration), ChipError<R::Error>> {
        let asked = self.port.now();
        let status = Status::decode(&self.port.read(register::SENSORTIME_0).await?);
        let answered = self.port.now();
        let took = answered.since(asked);
        self.on_bus = self.on_bus.min(took);
        // The time comes first, after the addresses: a quarter of the burst, on I2C as on SPI.
        let before = self.on_bus / 4;
        Ok((status, answered - (self.on_bus - before), took - before))
    }

    /// Empties the FIFO and forgets what the filter remembers.
    async fn restart_fifo(&mut self) -> Result<(), ChipError<R::Error>> {
        (self.decimator, self.peak) = Default::default();
        self.write(register::CMD, &[codec::FIFO_FLUSH]).await?;
        self.reading = false;
        self.due = self.port.now() + self.chip_period(4);
        Ok(())
    }

    /// The time of so many samples of the chip.
    fn chip_period(&self, samples: u64) -> Duration {
        ticks_to_micros(samples * self.config.rate.ticks())
    }

    /// The next group of four with the instant of its first sample; `None` when there is a gap before it.
    async fn group(&mut self, deadline: Instant) -> Result<Option<(Instant, [[i16; 6]; 4])>, ChipError<R::Error>> {
        let mut doubts = 0;
        loop {
            self.interrupt.wait(&mut self.port, self.due, ticks_to_micros(AIM)).await;
            let looks = self.port.now();
            let mut asked = self.status().await?;
            if !is_believable(&asked.0) {
                // A wrong bit on the bus is a hundred times as likely as a chip that restarted, and setting it up again
                // takes longer than motors turn without it.
                asked = self.status().await?;
            }
            let (status, told, after) = asked;
            if status.start_up != Status::RUNNING {
                self.running = false;
                return Err(ChipError::Restarted);
            }
            self.temperature = status.celsius().unwrap_or(self.temperature);
            let period = self.config.rate.ticks();
            let age = u64::from(status.sensor_time) % period;
            let frames = u64::from(status.fifo_bytes) / FRAME_BYTES as u64;
            let newest = told - ticks_to_micros(age);
            // Would the next sample have come while the status was on the bus?
            let ambiguous = age < EARLIEST || ticks_to_micros(age) + after >= ticks_to_micros(period);
            self.interrupt.judge(frames >= 4);
            if frames < 4 || ambiguous {
                doubts += u32::from(ambiguous);
                // By a look that began after that time: waiting for the bus is not the chip's.
                if frames < 4 && looks > deadline || doubts > DOUBTS {
                    self.running = false;
                    return Err(ChipError::NoSample);
                }
                let missing = 4u64.saturating_sub(frames).max(u64::from(age >= EARLIEST));
                self.due = newest + ticks_to_micros(missing * period + AIM);
                continue;
            }
            if frames >= OVERRUN {
                return Ok(None);
            }
            self.reading = true;
            let bytes = self.port.read(register::FIFO_DATA).await?;
            self.reading = false;
            self.due = newest + ticks_to_micros(8u64.saturating_sub(frames) * period + AIM);
            let Some(group) = codec::decode_frames(&bytes, status.holds_whole_frames()) else { return Ok(None) };
            return Ok(Some((newest - self.chip_period(frames - 1), group)));
        }
    }
}

/// Is this what a chip that runs says?
const fn is_believable(status: &Status) -> bool {
    status.start_up == Status::RUNNING && status.holds_whole_frames()
}

const fn ticks_to_micros(ticks: u64) -> Duration {
    Duration::from_micros(ticks.saturating_mul(5_000) / codec::TICKS_IN_5_MILLIS)
}

impl<R: Registers, T: Timebase, P: Wait> Imu for Bmi270<'_, R, T, P> {
    type Error = ChipError<R::Error>;

    async fn next(&mut self) -> Result<Sample<ImuData>, Self::Error> {
        if !self.running {
            self.start().await?;
        }
        let deadline = self.port.now() + self.chip_period(4 * PATIENCE);
        if core::mem::take(&mut self.reading) {
            // Nobody knows which frames that read took out; those that are still there begin anew.
            (self.decimator, self.peak) = Default::default();
        }
        loop {
            let Some((at, group)) = self.group(deadline).await? else {
                self.restart_fifo().await?;
                continue;
            };
            let peak = self.peak.push(&group);
            let Some(sum) = self.decimator.push(&group) else { continue };
            let [ax, ay, az, gx, gy, gz] = sum.map(|sixteenths| sixteenths as f32 / Decimator::GAIN as f32);
            let scale = GRAVITY / self.config.accel_range.counts_per_g();
            let accel = Vec3::new(ax, ay, az) * scale;
            // The factory's correction of the gyroscope's x axis (register 0x12).
            let gyro = Vec3::new(gx - self.cross_axis * gz, gy, gz)
                * (core::f32::consts::PI / 180.0 / self.config.gyro_range.counts_per_dps());
            let data = ImuData {
                accel: self.axes.to_body(accel),
                accel_peak: peak * scale,
                gyro: self.axes.to_body(gyro),
                temperature: self.temperature,
            };
            return Ok(Sample { at, data });
        }
    }
}
