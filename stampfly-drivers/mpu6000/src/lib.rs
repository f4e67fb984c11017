#![doc = include_str!("../README.md")]
#![no_std]

pub mod codec;
mod config;
mod wires;

use codec::register;
pub use config::{AccelRange, Config, Filter, GyroRange};
use embedded_hal_async::spi::SpiDevice;
#[cfg(feature = "embassy-time")]
pub use stampfly_driver_core::EmbassyClock;
use stampfly_driver_core::chip::Port;
pub use stampfly_driver_core::chip::{Axis, AxisMap, ChipError, TransferLimit};
pub use stampfly_driver_core::{Imu, Sample, Timebase};
pub use stampfly_driver_core::{SensorError, SensorErrorKind, blocking, embedded_hal, embedded_hal_async};
pub use stampfly_types::messages::ImuData;
pub use stampfly_types::{Duration, Instant};
use stampfly_types::{GRAVITY, Vec3};
pub use wires::BusClock;
use wires::Clocked;

/// Maximum time from power-on to the first access (PS 6.3), and the pause after each of the two
/// resets (RM 4.30).
const START_UP: Duration = Duration::from_millis(100);
/// Time from waking to valid gyroscope data, 30 ms (PS 6.1), with a margin. It includes the 10 ms
/// in which the clock derived from the gyroscope starts (PS 6.6).
const GYRO_START: Duration = Duration::from_millis(50);
/// Number of attempts to wake the chip, and the pause after each.
const WAKES: u8 = 5;
const WAKE: Duration = Duration::from_millis(5);
/// Period of the check that a running chip still holds its settings.
const WITNESS_INTERVAL: Duration = Duration::from_secs(1);
/// Longest time for which all seven values may stay equal. The noise of one axis alone is about one
/// count at ±2000 °/s (PS 6.1), and this time contains about a hundred independent samples.
const FROZEN: Duration = Duration::from_millis(200);
/// Self test: settling time after a change, and number of samples per state, 1 ms apart.
const SETTLE: Duration = Duration::from_millis(50);
const TEST_SAMPLES: u16 = 100;
/// Number of consecutive bursts without data after which the driver checks the chip's state.
const ATTEMPTS: u8 = 2;

/// The driver, on SPI in mode 0 or 3. Implements [`Imu`].
///
/// The chip's axes are those of the product specification ("orientation of axes"): a right-handed
/// frame with z out of the top of the package. At rest on a level surface the chip measures +1 g
/// along z. [`AxisMap`] turns the axes to the body's. Mounting angles other than multiples of 90°
/// are to be corrected by the vehicle.
///
/// `Sample::at` is the instant of the chip select, at which the chip latches its data. The data is
/// at most one sample period of the chip old (125 µs at 8 kHz), plus the delay of the low-pass
/// filter, 1 ms with [`Filter::Hz256`]; neither is subtracted. **The accelerometer always samples
/// at 1000 Hz**: at 4 kHz each of its samples is returned four times.
///
/// A caller that is late gets the newest sample, and the schedule continues from there.
/// `accel_peak` is zero, which means unknown.
///
/// A chip that restarted is asleep and all its data are zero. Such a burst is not returned as a
/// sample: the driver reads again and then checks the chip. A chip that does not hold its settings,
/// which the driver also checks once a second, is [`ChipError::Restarted`], and the next call sets
/// it up again. Values that stay equal for 0.2 s are [`ChipError::NoSample`].
///
/// A sample is 15 bytes on the bus: 6 µs at 20 MHz, 120 µs at 1 MHz.
///
/// ```
/// # use stampfly_driver_fakes::memory::Clock;
/// # let simulation = stampfly_sim::Simulation::new(&stampfly_sim::SimulationConfig::example());
/// # let time = simulation.clock.clone();
/// # let chip = stampfly_sim::chips::Mpu6000::new(&simulation.world, &time, 1, 0.0);
/// # let (device, _) = stampfly_sim::chips::SpiBus::new(&time, 1).attach(1_000_000, chip);
/// # let clock = time.clone();
/// # use stampfly_sim::time::block_on;
/// use stampfly_mpu6000::{Axis, AxisMap, Config, Imu, Mpu6000};
///
/// // The chip's x axis points right, y forward, z up.
/// let axes = AxisMap::new(Axis::PlusY, Axis::PlusX, Axis::MinusZ).expect("a rotation");
/// let mut imu = Mpu6000::new(device, clock, axes, Config::default());
/// # let next = imu.next();
/// # let sample = block_on(&time, next).expect("a sample");
/// # let mut imu = imu;
/// # // As on a board: `imu.next().await?`.
/// assert!((sample.data.accel.z + 9.81).abs() < 2.0, "level and still");
/// ```
#[derive(Debug)]
pub struct Mpu6000<S, T, F = fn(&mut S, BusClock)> {
    port: Port<Clocked<S, F>, T>,
    limit: TransferLimit,
    axes: AxisMap,
    config: Config,
    running: bool,
    /// Time of the next read.
    due: Instant,
    /// Time of the next check for a restart.
    witness: Instant,
    /// Shortest duration of a burst: the transfer alone, without waiting for the bus.
    on_bus: Duration,
    /// The last burst, and the time since which it has been the same.
    last: Option<(codec::Sample, Instant)>,
}

impl<S: SpiDevice, T: Timebase> Mpu6000<S, T> {
    /// A driver of the chip on this device, with the device's fixed bus clock of at most 1 MHz.
    pub fn new(device: S, clock: T, axes: AxisMap, config: Config) -> Self {
        Self::assembled(Clocked::new(device, |_, _| ()), clock, TransferLimit::SPI, axes, config)
    }

    /// Adds a function that changes the bus clock for this chip. The driver calls it before a
    /// transfer that needs another clock than the previous one.
    ///
    /// `SpiDevice` has no method for the clock, and each layer changes it in its own way, such as
    /// `set_config` of Embassy's `SpiDeviceWithConfig` or `bus_mut` of `ExclusiveDevice`. A
    /// function of the device fits all of them. The alternative, two devices with one chip select,
    /// would need a cell around the pin.
    ///
    /// ```
    /// use stampfly_mpu6000::embedded_hal_async::spi::SpiDevice;
    /// use stampfly_mpu6000::{AxisMap, BusClock, Config, Imu, Mpu6000, Timebase};
    ///
    /// /// A layer's device whose clock can be changed.
    /// trait Changeable {
    ///     fn set_frequency(&mut self, hertz: u32);
    /// }
    ///
    /// fn fast(device: impl SpiDevice + Changeable, clock: impl Timebase) -> impl Imu {
    ///     Mpu6000::new(device, clock, AxisMap::IDENTITY, Config::default()).with_bus_clock(|device, clock| {
    ///         device.set_frequency(match clock {
    ///             BusClock::Setup => 1_000_000,
    ///             BusClock::Data => 20_000_000,
    ///         });
    ///     })
    /// }
    /// ```
    pub fn with_bus_clock<F: FnMut(&mut S, BusClock)>(self, change: F) -> Mpu6000<S, T, F> {
        let Self { port, limit, axes, config, .. } = self;
        let (device, clock) = port.release();
        Mpu6000::assembled(Clocked::new(device, change), clock, limit, axes, config)
    }
}

impl<S: SpiDevice, T: Timebase, F: FnMut(&mut S, BusClock)> Mpu6000<S, T, F> {
    fn assembled(wires: Clocked<S, F>, clock: T, limit: TransferLimit, axes: AxisMap, config: Config) -> Self {
        Self {
            port: Port::new(wires, clock, limit),
            limit,
            axes,
            config,
            running: false,
            due: Instant::ZERO,
            witness: Instant::ZERO,
            on_bus: Duration::from_secs(1),
            last: None,
        }
    }

    /// Gives up a transfer after this time instead of [`TransferLimit::SPI`].
    #[must_use]
    pub fn with_transfer_limit(mut self, limit: TransferLimit) -> Self {
        self.port.limit_transfers(limit);
        self.limit = limit;
        self
    }

    /// Takes the driver apart and returns the device and the clock. The chip continues to measure.
    pub fn release(self) -> (S, T) {
        self.port.release()
    }

    /// Sets the chip up: identification, reset, reset of the signal paths, clock, ranges and
    /// low-pass filter, with read-back. 250 ms.
    ///
    /// # Errors
    /// [`ChipError::Identification`], [`ChipError::InvalidConfiguration`],
    /// [`ChipError::Configuration`] when a setting was not kept, and errors of the bus.
    pub async fn start(&mut self) -> Result<(), ChipError<S::Error>> {
        self.running = false;
        if !codec::is_sampled_often_enough(&self.config) {
            return Err(ChipError::InvalidConfiguration);
        }
        self.set_up(codec::settings(&self.config)).await?;
        self.witness = self.port.now() + WITNESS_INTERVAL;
        self.due = self.port.now();
        (self.last, self.on_bus) = (None, Duration::from_secs(1));
        self.running = true;
        Ok(())
    }

    /// Deflects the proof masses of both sensors and compares the responses with the factory's (RM
    /// 4.1). Takes 0.65 s, during which the vehicle must not move. The next call sets the chip up
    /// again.
    ///
    /// # Errors
    /// [`ChipError::SelfTest`], and those of [`start`](Self::start).
    pub async fn self_test(&mut self) -> Result<(), ChipError<S::Error>> {
        self.running = false;
        let (gyro, accel) = (GyroRange::Dps250.code(), AccelRange::G8.code());
        self.set_up([0, Filter::Hz188.code(), gyro, accel]).await?;
        let factory = codec::factory_answers(self.port.read_twice(register::SELF_TEST).await?);
        let without = self.mean().await?;
        self.port.write(register::GYRO_CONFIG, &[codec::TEST_ALL | gyro]).await?;
        self.port.write(register::ACCEL_CONFIG, &[codec::TEST_ALL | accel]).await?;
        let mut answers = self.mean().await?;
        self.port.write(register::GYRO_CONFIG, &[gyro]).await?;
        self.port.write(register::ACCEL_CONFIG, &[accel]).await?;
        answers.iter_mut().zip(without).for_each(|(with, without)| *with -= without);
        if codec::passes_self_test(&answers, &factory) { Ok(()) } else { Err(ChipError::SelfTest) }
    }

    /// Resets the chip from any state and applies these settings.
    async fn set_up(&mut self, settings: [u8; 4]) -> Result<(), ChipError<S::Error>> {
        self.port.wait_until(Instant::ZERO + START_UP).await;
        let [mut found]: [u8; 1] = self.port.read(register::WHO_AM_I).await?;
        if found != codec::IDENTITY {
            // The program before this one may have started a reset that is still in progress.
            self.port.wait(START_UP).await;
            [found] = self.port.read(register::WHO_AM_I).await?;
        }
        if found != codec::IDENTITY {
            return Err(ChipError::Identification { found: u16::from(found) });
        }
        self.port.write(register::PWR_MGMT_1, &[codec::RESET]).await?;
        self.port.wait(START_UP).await;
        // On SPI the device reset must be followed by a reset of the signal paths (RM 4.30).
        self.port.write(register::SIGNAL_PATH_RESET, &[codec::ALL_PATHS]).await?;
        self.port.wait(START_UP).await;
        // The reset has enabled I2C again.
        self.port.write(register::USER_CTRL, &[codec::SPI_ONLY]).await?;
        self.wake().await?;
        self.port.write(register::SMPLRT_DIV, &settings).await?;
        // Time for the gyroscope to start, which is also the clock source now.
        self.port.wait(GYRO_START).await;
        let kept: [u8; 4] = self.port.read(register::SMPLRT_DIV).await?;
        if let Some((kept, _)) = kept.into_iter().zip(settings).find(|(kept, wanted)| kept != wanted) {
            return Err(ChipError::Configuration { status: kept });
        }
        let [power]: [u8; 1] = self.port.read(register::PWR_MGMT_1).await?;
        if power == codec::AWAKE { Ok(()) } else { Err(ChipError::Configuration { status: power }) }
    }

    /// Wakes the chip, with several attempts: public reports describe chips that stay asleep at the
    /// first request after a reset.
    async fn wake(&mut self) -> Result<(), ChipError<S::Error>> {
        let mut power = 0;
        for _ in 0..WAKES {
            self.port.write(register::PWR_MGMT_1, &[codec::AWAKE]).await?;
            self.port.wait(WAKE).await;
            [power] = self.port.read(register::PWR_MGMT_1).await?;
            if power == codec::AWAKE {
                return Ok(());
            }
        }
        Err(ChipError::Configuration { status: power })
    }

    /// Mean of accelerometer and gyroscope, counts, after settling.
    async fn mean(&mut self) -> Result<[f32; 6], ChipError<S::Error>> {
        self.port.wait(SETTLE).await;
        let mut sums = [0_i32; 6];
        for _ in 0..TEST_SAMPLES {
            self.port.wait(Duration::from_millis(1)).await;
            let codec::Sample { accel: [ax, ay, az], gyro: [gx, gy, gz], .. } = self.burst().await?.0;
            sums.iter_mut().zip([ax, ay, az, gx, gy, gz]).for_each(|(sum, value)| *sum += i32::from(value));
        }
        Ok(sums.map(|sum| sum as f32 / f32::from(TEST_SAMPLES)))
    }

    /// A sample, and the instant of the chip select.
    async fn burst(&mut self) -> Result<(codec::Sample, Instant), ChipError<S::Error>> {
        for _ in 0..ATTEMPTS {
            let asked = self.port.now();
            let bytes = self.port.read(register::ACCEL_XOUT_H).await?;
            let answered = self.port.now();
            self.on_bus = self.on_bus.min(answered.since(asked));
            if let Some(sample) = codec::Sample::decode(&bytes) {
                return Ok((sample, answered - self.on_bus));
            }
        }
        self.running = false;
        let [power]: [u8; 1] = self.port.read(register::PWR_MGMT_1).await?;
        // An awake chip without data is a fault of the bus; a sleeping one has restarted.
        Err(if power == 0xFF || power == codec::AWAKE { ChipError::Data } else { ChipError::Restarted })
    }

    /// Checks that the chip still holds its settings.
    async fn check(&mut self) -> Result<(), ChipError<S::Error>> {
        if self.port.now() < self.witness {
            return Ok(());
        }
        let settings = codec::settings(&self.config);
        for _ in 0..2 {
            // Two reads, so that one wrong bit on the bus does not cause a new set-up.
            if self.port.read(register::SMPLRT_DIV).await? == settings {
                self.witness = self.port.now() + WITNESS_INTERVAL;
                return Ok(());
            }
        }
        self.running = false;
        Err(ChipError::Restarted)
    }
}

impl<S: SpiDevice, T: Timebase, F: FnMut(&mut S, BusClock)> Imu for Mpu6000<S, T, F> {
    type Error = ChipError<S::Error>;

    async fn next(&mut self) -> Result<Sample<ImuData>, Self::Error> {
        if !self.running {
            self.start().await?;
        }
        self.check().await?;
        self.port.wait_until(self.due).await;
        let (sample, at) = self.burst().await?;
        // Keeps the schedule, unless the next planned time has passed as well.
        let planned = self.due + self.config.interval;
        self.due = if planned > at { planned } else { at + self.config.interval };
        match self.last {
            Some((last, since)) if last == sample => {
                // Noise alone changes the values; equal ones come from a chip that has stopped
                // sampling.
                if at.since(since) > FROZEN {
                    self.running = false;
                    return Err(ChipError::NoSample);
                }
            }
            _ => self.last = Some((sample, at)),
        }
        let vector = |[x, y, z]: [i16; 3], scale: f32| {
            self.axes.to_body(Vec3::new(f32::from(x), f32::from(y), f32::from(z)) * scale)
        };
        let data = ImuData {
            accel: vector(sample.accel, GRAVITY / self.config.accel_range.counts_per_g()),
            accel_peak: 0.0,
            gyro: vector(sample.gyro, core::f32::consts::PI / 180.0 / self.config.gyro_range.counts_per_dps()),
            temperature: sample.celsius(),
        };
        Ok(Sample { at, data })
    }
}
