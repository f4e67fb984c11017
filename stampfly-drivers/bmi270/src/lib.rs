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

/// Wait before the first access after power-on and after leaving power saving (§4 "Start-up").
const POWER_UP: Duration = Duration::from_micros(450);
/// Pause after a write in normal mode, from "Interface" and the timing tables of the data sheet.
const AFTER_WRITE: Duration = Duration::from_micros(2);
const SOFT_RESET: Duration = Duration::from_micros(2_000);
/// Time limit for the start with a configuration, which typically takes 20 ms.
const START_UP_LIMIT: Duration = Duration::from_millis(150);
/// Start-up of the gyroscope, 45 ms (§1.2), with a margin.
const GYRO_START: Duration = Duration::from_millis(50);
/// Settling time of each deflection in the self test, 50 ms (§4 "Sensor self-test"), with a margin.
const SELF_TEST_SETTLE: Duration = Duration::from_millis(51);
/// Time limit of the gyroscope's self test. The data sheet gives no figure; Bosch's sensor API
/// waits this long.
const GYRO_SELF_TEST_LIMIT: Duration = Duration::from_secs(2);
/// Pause between enabling the accelerometer and selecting the test, as in Bosch's sensor API.
const BEFORE_GYRO_SELF_TEST: Duration = Duration::from_millis(1);
/// Ticks of the sensor time from a sample to the planned read, and to the earliest read that is
/// accepted. Earlier than that the FIFO may or may not contain the sample.
const AIM: u64 = 3;
const EARLIEST: u64 = 2;
/// A fill level, in frames, at which the FIFO of 2 kB, 157 frames, may already have lost some.
const OVERRUN: u64 = 150;
/// Number of consecutive status reads that may be ambiguous because other devices delayed the bus.
const DOUBTS: u32 = 32;
/// Number of output periods without samples after which `next` fails.
const PATIENCE: u64 = 4;

/// The driver. Implements [`Imu`].
///
/// `Sample::at` is the centre of the decimation filter: at 400 Hz three chip samples (1.9 ms)
/// before the newest one, by the chip's clock. It is accurate to one tick of that clock (39 µs) and
/// the time that the address takes on the bus (4 µs on SPI at 10 MHz, 0.1 ms on I2C at 400 kHz).
/// The small delay of the chip's own low-pass filter is not subtracted.
///
/// A caller that is late still gets every sample of the last 90 ms (at 400 Hz). Each is stamped by
/// the nominal rate, so its error is that of the chip's clock over the delay, 2 %. After a longer
/// delay, or when the FIFO contains other frames than samples, the driver empties the FIFO and
/// restarts the filter, which takes two output periods. After a read that failed or was dropped,
/// the filter restarts with the frames that are still in the FIFO. After four output periods
/// without a sample the driver returns [`ChipError::NoSample`].
///
/// A single wrong bit on the bus loses no sample: an implausible status is read again before the
/// chip counts as restarted, and one wrong bit in the header of a frame is tolerated. A wrong bit
/// in a measured value cannot be detected.
///
/// [`with_interrupt`](Self::with_interrupt) takes the pin connected to INT1 (GPIO 11 on the
/// StampFly).
///
/// The chip does not run without a configuration of 8 kB that Bosch publishes with its sensor API
/// (`bmi270_config_file`). It is not part of this crate.
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
    /// A FIFO read is in progress. Still set in the next call if this one was dropped during the
    /// read.
    reading: bool,
    decimator: Decimator,
    peak: Peak,
    /// Time of the next status read.
    due: Instant,
    /// Shortest duration of a status read: the transfer alone, without waiting for the bus.
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
    /// The chip on I2C, at address 0x68 (SDO low) or 0x69. Reading a sample occupies a 400 kHz bus
    /// for 1.7 ms.
    pub fn i2c(bus: I, address: u8, clock: T, blob: &'b [u8], axes: AxisMap, config: Config) -> Self {
        Self::new(I2cRegisters::new(bus, address), clock, blob, axes, config)
    }
}

impl<R: Wires, T, P> Bmi270<'_, R, T, P> {
    stampfly_driver_core::transfer_limit!();

    /// Takes the driver apart and returns the bus or device, the clock and the interrupt pin, if
    /// any. The chip continues to measure.
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
            // Zero point of the chip's scale, used until the first measurement.
            temperature: 23.0,
        }
    }

    /// The same driver with the pin connected to INT1. The chip drives it high when four samples
    /// are ready.
    pub fn with_interrupt<P: Wait>(self, pin: P) -> Bmi270<'b, R, T, P> {
        let Self { port, blob, axes, config, reading, decimator, peak, due, on_bus, cross_axis, temperature, .. } =
            self;
        let interrupt = Interrupt::on(pin);
        // `running: false`: the next call sets the chip up again, with the interrupt.
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
    /// [`ChipError::Identification`], [`ChipError::InvalidConfiguration`] for a configuration file
    /// of invalid length, [`ChipError::Configuration`] when the chip refuses the file or the
    /// settings, and errors of the bus.
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
        // The chip rejects invalid combinations and reports them in the status.
        let kept: [u8; 4] = self.port.read(register::ACC_CONF).await?;
        let (status, ..) = self.status().await?;
        if kept != wanted || status.configuration_error {
            return Err(ChipError::Configuration { status: kept[0] });
        }
        self.temperature = status.celsius().unwrap_or(self.temperature);
        // Read twice, because the factor stays in use until the next start.
        let [factor]: [u8; 1] = self.port.read_twice(register::GYR_CAS).await?;
        self.cross_axis = f32::from(codec::cross_axis_factor(factor)) / 512.0;
        self.restart_fifo().await?;
        self.running = true;
        Ok(())
    }

    /// Self test of the accelerometer: deflects the proof masses in both directions and compares.
    /// Takes 170 ms, during which the vehicle must not move. The next call sets the chip up again.
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

    /// Self test of the gyroscope's drive, by the chip. The vehicle must not move. Takes at most
    /// 2.2 s. The next call sets the chip up again.
    ///
    /// The test is a feature of the full configuration file; with the short file for the FIFO only
    /// it fails. The sequence is that of Bosch's sensor API, because the data sheet specifies only
    /// the registers. **Unverified** on a chip.
    ///
    /// # Errors
    /// [`ChipError::SelfTest`], also on a time-out, and those of [`start`](Self::start).
    pub async fn gyro_self_test(&mut self) -> Result<(), ChipError<R::Error>> {
        self.running = false;
        self.upload().await?;
        self.write(register::GYR_CRT_CONF, &[codec::GYRO_TEST_RUNS]).await?;
        // Gyroscope off, accelerometer on: the test uses it to check that the vehicle does not
        // move.
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

    /// Reset, identification and configuration file, until the chip reports that it runs.
    async fn upload(&mut self) -> Result<(), ChipError<R::Error>> {
        if self.blob.is_empty() || !self.blob.len().is_multiple_of(2) || self.blob.len() > codec::BLOB_LIMIT {
            return Err(ChipError::InvalidConfiguration);
        }
        // The chip starts in I2C mode and changes to SPI at the first rising edge of its chip
        // select. The result of this read is meaningless.
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
            // The address counts in words and is set for each piece, so a piece has an even length.
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
                // Initialisation still in progress.
                0 if looks < deadline => self.port.wait(Duration::from_millis(1)).await,
                _ => return Err(ChipError::Configuration { status }),
            }
        }
    }

    /// Writes, and waits for the minimum time before the next access.
    async fn write(&mut self, register: u8, bytes: &[u8]) -> Result<(), ChipError<R::Error>> {
        self.port.write(register, bytes).await?;
        self.port.wait(AFTER_WRITE).await;
        Ok(())
    }

    /// Reads the status. Also returns the instant of the sensor time in it, and an upper bound of
    /// the time from then until the fill level was read.
    async fn status(&mut self) -> Result<(Status, Instant, Duration), ChipError<R::Error>> {
        let asked = self.port.now();
        let status = Status::decode(&self.port.read(register::SENSORTIME_0).await?);
        let answered = self.port.now();
        let took = answered.since(asked);
        self.on_bus = self.on_bus.min(took);
        // The sensor time follows the addresses, after about a quarter of the burst on I2C and SPI.
        let before = self.on_bus / 4;
        Ok((status, answered - (self.on_bus - before), took - before))
    }

    /// Empties the FIFO and resets the filters.
    async fn restart_fifo(&mut self) -> Result<(), ChipError<R::Error>> {
        (self.decimator, self.peak) = Default::default();
        self.write(register::CMD, &[codec::FIFO_FLUSH]).await?;
        self.reading = false;
        self.due = self.port.now() + self.chip_period(4);
        Ok(())
    }

    /// Duration of this number of the chip's samples, at the nominal rate.
    fn chip_period(&self, samples: u64) -> Duration {
        ticks_to_micros(samples * self.config.rate.ticks())
    }

    /// The next group of four samples with the instant of the first one; `None` when samples before
    /// it were lost.
    async fn group(&mut self, deadline: Instant) -> Result<Option<(Instant, [[i16; 6]; 4])>, ChipError<R::Error>> {
        let mut doubts = 0;
        loop {
            self.interrupt.wait(&mut self.port, self.due, ticks_to_micros(AIM)).await;
            let looks = self.port.now();
            let mut asked = self.status().await?;
            if !is_believable(&asked.0) {
                // A wrong bit on the bus is a hundred times as likely as a restart of the chip, and
                // a new set-up takes longer than the motors turn without samples.
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
            // The status is ambiguous when the next sample may have arrived during its transfer.
            let ambiguous = age < EARLIEST || ticks_to_micros(age) + after >= ticks_to_micros(period);
            self.interrupt.judge(frames >= 4);
            if frames < 4 || ambiguous {
                doubts += u32::from(ambiguous);
                // Only a read that began after the deadline counts, so that a wait for the bus is
                // not mistaken for a failure of the chip.
                if frames < 4 && looks > deadline || doubts > DOUBTS {
                    self.running = false;
                    return Err(ChipError::NoSample);
                }
                // Sample periods until four frames are complete. At least one after a read too late
                // in its period; a read too early in it is repeated within the same period.
                let missing = 4u64.saturating_sub(frames).max(u64::from(age >= EARLIEST));
                self.due = newest + ticks_to_micros(missing * period + AIM);
                continue;
            }
            // Samples may have been lost, so the caller empties the FIFO and restarts the filter.
            if frames >= OVERRUN {
                return Ok(None);
            }
            self.reading = true;
            let bytes = self.port.read(register::FIFO_DATA).await?;
            self.reading = false;
            // After this read `frames` − 4 are left, so the next four are complete in 8 − `frames`
            // periods.
            self.due = newest + ticks_to_micros(8u64.saturating_sub(frames) * period + AIM);
            let Some(group) = codec::decode_frames(&bytes, status.holds_whole_frames()) else { return Ok(None) };
            return Ok(Some((newest - self.chip_period(frames - 1), group)));
        }
    }
}

/// Whether the status is plausible for a running chip.
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
            // It is unknown which frames the dropped read has removed, so the filters restart with
            // those that are left.
            (self.decimator, self.peak) = Default::default();
        }
        loop {
            let Some((at, group)) = self.group(deadline).await? else {
                self.restart_fifo().await?;
                continue;
            };
            let peak = self.peak.push(&group);
            // The first group only fills the filter.
            let Some(sum) = self.decimator.push(&group) else { continue };
            let [ax, ay, az, gx, gy, gz] = sum.map(|sixteenths| sixteenths as f32 / Decimator::GAIN as f32);
            let scale = GRAVITY / self.config.accel_range.counts_per_g();
            let accel = Vec3::new(ax, ay, az) * scale;
            // Factory correction of the cross-axis sensitivity of the x axis (register 0x12).
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
