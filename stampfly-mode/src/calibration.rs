//! Still-calibration: wait until nobody touches the vehicle, then average.
//!
//! A vehicle that calibrates in somebody's hand flips after take-off. So the average only counts samples of a period
//! in which the gyro and the accelerometer were quiet from beginning to end; any motion starts it again. Limits are
//! the StampFly's (BMI270); the method is the exponentially weighted mean and variance.
//!
//! Not for soft or hard iron, nor for accelerometer scale: those need the vehicle to be turned.

use stampfly_types::messages::{BaroData, CalibrationResult, ImuData, MagData};
use stampfly_types::{Micros, Vec3};

/// What counts as still.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StillnessConfig {
    /// Largest mean angular rate, rad/s. Above the gyro's own offset, which may be 1 °/s an axis.
    pub rate_max: f32,
    /// Largest variance of the angular rate, (rad/s)².
    pub rate_variance_max: f32,
    /// Mean specific force must lie between these, m/s².
    pub force_range: [f32; 2],
    /// Largest variance of the specific force, (m/s²)².
    pub force_variance_max: f32,
    /// Time to settle before the average begins, s.
    pub settle: f32,
    /// Samples averaged.
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

/// Weight of a new sample in the running mean and variance: about 50 ms at 400 Hz.
const WEIGHT: f32 = 0.05;

/// Mean and variance with an exponential window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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

/// The still-calibration.
///
/// ```
/// use stampfly_mode::StillCalibration;
/// use stampfly_types::{Micros, Vec3, messages::ImuData};
/// let mut calibration = StillCalibration::default();
/// let still = ImuData { accel: Vec3::new(0.0, 0.0, -9.81), gyro: Vec3::new(0.01, 0.0, 0.0), temperature: 25.0 };
/// for k in 0..1500 {
///     calibration.step(Micros(2_500 * k), &still);
/// }
/// let result = calibration.result();
/// assert!(result.complete && (result.gyro_bias.x - 0.01).abs() < 1e-5);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct StillCalibration {
    config: StillnessConfig,
    rate: Spread,
    force: Spread,
    since: Option<Micros>,
    count: u32,
    rate_sum: Vec3,
    force_sum: Vec3,
    field: Vec3,
    altitude: Option<f32>,
    result: CalibrationResult,
}

impl Default for StillCalibration {
    fn default() -> Self {
        Self::new(StillnessConfig::default())
    }
}

impl StillCalibration {
    /// Nothing collected yet.
    #[must_use]
    pub fn new(config: StillnessConfig) -> Self {
        Self {
            config,
            rate: Spread::default(),
            force: Spread::default(),
            since: None,
            count: 0,
            rate_sum: Vec3::zeros(),
            force_sum: Vec3::zeros(),
            field: Vec3::zeros(),
            altitude: None,
            result: CalibrationResult::default(),
        }
    }

    fn is_still(&self) -> bool {
        let [low, high] = self.config.force_range;
        self.rate.mean.norm() <= self.config.rate_max
            && self.rate.variance <= self.config.rate_variance_max
            && (low..=high).contains(&self.force.mean.norm())
            && self.force.variance <= self.config.force_variance_max
    }

    /// Takes an inertial sample. After completion nothing changes any more.
    pub fn step(&mut self, now: Micros, imu: &ImuData) {
        if self.result.complete || !imu.accel.iter().chain(imu.gyro.iter()).all(|v| v.is_finite()) {
            return;
        }
        if self.since.is_none() {
            // The first sample is the first mean; a variance counted from zero would be motion.
            (self.rate.mean, self.force.mean) = (imu.gyro, imu.accel);
        }
        self.rate.add(&imu.gyro);
        self.force.add(&imu.accel);
        let since = *self.since.get_or_insert(now);
        if !self.is_still() {
            if self.count > 0 {
                self.result.restarts = self.result.restarts.wrapping_add(1);
            }
            self.since = Some(now);
            (self.count, self.rate_sum, self.force_sum) = (0, Vec3::zeros(), Vec3::zeros());
        } else if now.since(since).seconds() >= self.config.settle {
            self.count += 1;
            self.rate_sum += imu.gyro;
            self.force_sum += imu.accel;
        }
        self.result.progress = self.count as f32 / self.config.samples as f32;
        if self.count >= self.config.samples {
            let share = 1.0 / self.count as f32;
            self.result.gyro_bias = self.rate_sum * share;
            self.result.specific_force = self.force_sum * share;
            self.result.field = self.field;
            self.result.baro_altitude = self.altitude.unwrap_or(0.0);
            self.result.progress = 1.0;
            self.result.complete = true;
        }
    }

    /// Takes a magnetometer sample.
    pub fn add_mag(&mut self, mag: &MagData) {
        if mag.field.iter().all(|v| v.is_finite()) {
            let first = self.field == Vec3::zeros();
            self.field += (mag.field - self.field) * if first { 1.0 } else { 0.1 };
        }
    }

    /// Takes a barometer sample.
    pub fn add_baro(&mut self, baro: &BaroData) {
        if baro.altitude.is_finite() {
            self.altitude = Some(self.altitude.map_or(baro.altitude, |a| a + 0.1 * (baro.altitude - a)));
        }
    }

    /// What has been found so far.
    #[must_use]
    pub fn result(&self) -> CalibrationResult {
        self.result
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn still() -> ImuData {
        ImuData { accel: Vec3::new(0.1, 0.0, -9.8), gyro: Vec3::new(0.01, -0.02, 0.005), temperature: 30.0 }
    }

    #[test]
    fn motion_starts_the_average_again() {
        let mut calibration = StillCalibration::default();
        for k in 0..1000u64 {
            calibration.step(Micros(2_500 * k), &still());
        }
        assert!(calibration.result().progress > 0.5);
        for k in 1000..1020u64 {
            calibration.step(Micros(2_500 * k), &ImuData { gyro: Vec3::new(1.0, 0.0, 0.0), ..still() });
        }
        assert_eq!((calibration.result().progress, calibration.result().restarts), (0.0, 1));
        for k in 1020..4000u64 {
            calibration.step(Micros(2_500 * k), &still());
        }
        let result = calibration.result();
        assert!(result.complete && (result.gyro_bias - still().gyro).norm() < 1e-5, "the motion left no trace");
    }

    #[test]
    fn a_hand_is_never_still() {
        let mut calibration = StillCalibration::default();
        for k in 0..8000u64 {
            let swing = stampfly_types::math::sin(k as f32 * 0.03) * 0.2;
            calibration.step(Micros(2_500 * k), &ImuData { gyro: Vec3::new(swing, 0.0, 0.0), ..still() });
        }
        assert!(!calibration.result().complete);
    }
}
