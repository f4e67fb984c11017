//! Means over stretches of time in which the vehicle lies still.
//!
//! A bias averaged while the vehicle is held in a hand would make it flip after take-off. A mean
//! therefore contains only samples of a period in which gyro and accelerometer were quiet
//! throughout; any motion restarts it. Default limits are those of the StampFly (BMI270); the
//! method is an exponentially weighted mean and variance.
//!
//! Use it to build a calibration. Not for deciding in flight whether the vehicle stands: a hover in
//! calm air is as quiet as a table.

use stampfly_types::messages::ImuData;
use stampfly_types::{Instant, Vec3, math};

/// Definition of still.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StillnessConfig {
    /// Largest mean angular rate, rad/s. Above the gyro's own bias, which may be 1 °/s per axis.
    pub rate_max: f32,
    /// Largest variance of the angular rate, (rad/s)².
    pub rate_variance_max: f32,
    /// Range of the mean specific force, m/s².
    pub force_range: [f32; 2],
    /// Largest variance of the specific force, (m/s²)².
    pub force_variance_max: f32,
    /// Time to settle before the average begins, s.
    pub settle: f32,
    /// Number of samples in a mean.
    pub samples: u32,
}

impl Default for StillnessConfig {
    fn default() -> Self {
        Self {
            rate_max: 0.06,
            rate_variance_max: 1e-3,
            force_range: [9.3, 10.3],
            force_variance_max: 0.05,
            settle: 1.0,
            samples: 1000,
        }
    }
}

/// Reason for which a sample does not belong to a still stretch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NotStill {
    /// A value is not finite, or beyond any sensor. The sample is skipped and the stretch
    /// continues.
    NotFinite,
    /// The mean angular rate is above the limit.
    Turning,
    /// The variance of the angular rate is above the limit.
    Trembling,
    /// An axis repeats its value although a sensor has noise: the sensor is frozen. Tested by
    /// [`StillCalibration`] only.
    ///
    /// [`StillCalibration`]: super::StillCalibration
    Frozen,
    /// The length of the mean specific force is outside `force_range`.
    NotGravity,
    /// The variance of the specific force is above the limit.
    Shaken,
}

/// Mean of a still stretch.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StillMean {
    /// Mean angular rate, body FRD, rad/s: the gyro bias.
    pub gyro: Vec3,
    /// Mean specific force, body FRD, m/s².
    pub accel: Vec3,
    /// Mean temperature of the sensor, °C; `None` if a sample had none.
    pub temperature: Option<f32>,
    /// Standard deviation of one gyro sample, rad/s.
    pub gyro_noise: Vec3,
    /// Standard deviation of one accelerometer sample, m/s².
    pub accel_noise: Vec3,
    /// Number of samples in the mean.
    pub samples: u32,
}

/// Weight of a new sample in the running mean and variance: about 50 ms at 400 Hz.
const WEIGHT: f32 = 0.05;
/// Largest plausible value in any unit used here. Its square is far from overflow.
const LARGEST: f32 = 1e6;

/// Mean and variance with an exponential window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Spread {
    mean: Vec3,
    variance: f32,
}

impl Spread {
    fn add(&mut self, value: &Vec3) {
        let off = value - self.mean;
        self.mean += off * WEIGHT;
        self.variance += WEIGHT * (off.norm_squared() - self.variance);
    }
}

/// Sums over one stretch. Squares are relative to the first value: in `f32`, the difference of
/// large squares would be noise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Sums {
    first: Vec3,
    sum: Vec3,
    squares: Vec3,
}

impl Sums {
    fn add(&mut self, value: &Vec3, count: u32) {
        if count == 1 {
            self.first = *value;
        }
        self.sum += value;
        let off = value - self.first;
        self.squares += off.component_mul(&off);
    }

    /// Mean and standard deviation.
    fn finish(&self, share: f32) -> (Vec3, Vec3) {
        let mean = self.sum * share;
        let off = mean - self.first;
        (mean, (self.squares * share - off.component_mul(&off)).map(math::sqrt))
    }
}

/// Averages consecutive still stretches of a fixed number of samples.
///
/// ```
/// use stampfly_eskf::calibration::{NotStill, StillAverage, StillnessConfig};
/// use stampfly_types::{Instant, Vec3, messages::ImuData};
/// let mut average = StillAverage::new(StillnessConfig { samples: 100, settle: 0.5, ..Default::default() });
/// let still = ImuData { accel: Vec3::new(0.0, 0.0, -9.81), gyro: Vec3::new(0.01, 0.0, 0.0), temperature: 25.0, ..Default::default() };
/// let first = (0..).find_map(|k| average.step(Instant::from_micros(2_500 * k), &still).unwrap()).unwrap();
/// assert!((first.gyro.x - 0.01).abs() < 1e-6 && first.samples == 100);
/// let turning = ImuData { gyro: Vec3::new(5.0, 0.0, 0.0), ..still };
/// assert_eq!(average.step(Instant::from_secs(1), &turning), Err(NotStill::Turning));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StillAverage {
    config: StillnessConfig,
    rate: Spread,
    force: Spread,
    since: Option<Instant>,
    count: u32,
    gyro: Sums,
    accel: Sums,
    temperature: f32,
}

impl Default for StillAverage {
    fn default() -> Self {
        Self::new(StillnessConfig::default())
    }
}

impl StillAverage {
    /// Nothing collected yet.
    #[must_use]
    pub fn new(config: StillnessConfig) -> Self {
        Self {
            config,
            rate: Spread::default(),
            force: Spread::default(),
            since: None,
            count: 0,
            gyro: Sums::default(),
            accel: Sums::default(),
            temperature: 0.0,
        }
    }

    /// The configuration.
    #[must_use]
    pub fn config(&self) -> StillnessConfig {
        self.config
    }

    /// Collected share of the present stretch, 0 to 1.
    #[must_use]
    pub fn progress(&self) -> f32 {
        self.count as f32 / self.config.samples.max(1) as f32
    }

    fn check(&self) -> Result<(), NotStill> {
        let [low, high] = self.config.force_range;
        // Written so that NaN counts as motion.
        let checks = [
            (self.rate.mean.norm() <= self.config.rate_max, NotStill::Turning),
            (self.rate.variance <= self.config.rate_variance_max, NotStill::Trembling),
            ((low..=high).contains(&self.force.mean.norm()), NotStill::NotGravity),
            (self.force.variance <= self.config.force_variance_max, NotStill::Shaken),
        ];
        checks.iter().find(|(passed, _)| !passed).map_or(Ok(()), |(_, reason)| Err(*reason))
    }

    /// Drops the stretch; the next one settles first.
    pub(super) fn drop_stretch(&mut self, now: Instant) {
        self.since = Some(now);
        self.start_again();
    }

    fn start_again(&mut self) {
        *self = Self { rate: self.rate, force: self.force, since: self.since, ..Self::new(self.config) };
    }

    /// Takes an inertial sample, in order. Returns the mean with the last sample of a stretch. The
    /// next stretch begins with the next sample, without settling.
    ///
    /// # Errors
    /// The kind of motion. The stretch restarts, except for a sample that is not finite.
    pub fn step(&mut self, now: Instant, imu: &ImuData) -> Result<Option<StillMean>, NotStill> {
        if !imu.accel.iter().chain(imu.gyro.iter()).all(|v| v.abs() <= LARGEST) {
            return Err(NotStill::NotFinite);
        }
        if self.since.is_none() {
            // Start the mean at the first sample: started at zero, the variance would look like
            // motion.
            (self.rate.mean, self.force.mean) = (imu.gyro, imu.accel);
        }
        self.rate.add(&imu.gyro);
        self.force.add(&imu.accel);
        let since = *self.since.get_or_insert(now);
        if let Err(reason) = self.check() {
            self.drop_stretch(now);
            return Err(reason);
        }
        if now.since(since).seconds() < self.config.settle {
            return Ok(None);
        }
        self.count = self.count.saturating_add(1);
        self.gyro.add(&imu.gyro, self.count);
        self.accel.add(&imu.accel, self.count);
        self.temperature += imu.temperature;
        if self.count < self.config.samples {
            return Ok(None);
        }
        let share = 1.0 / self.count as f32;
        let (gyro, gyro_noise) = self.gyro.finish(share);
        let (accel, accel_noise) = self.accel.finish(share);
        let temperature = Some(self.temperature * share).filter(|mean| mean.is_finite());
        let mean = StillMean { gyro, accel, temperature, gyro_noise, accel_noise, samples: self.count };
        self.start_again();
        Ok(Some(mean))
    }
}
