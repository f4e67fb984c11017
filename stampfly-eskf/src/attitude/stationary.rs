//! Stationary detection (VQF's rest detection): the gyro of a stationary body measures its bias.
//!
//! The body is stationary while gyro and accelerometer stay close to their low-passed values and
//! the gyro's mean is small enough to be a bias. A perfectly smooth turn slower than the largest
//! bias is taken for rest; inertial sensors cannot distinguish them, a magnetic field can
//! ([`witness`](super::witness)). A vehicle with running motors is never stationary for this
//! detector.
//!
//! After Laidig, Seel, "VQF", Information Fusion 91, 2023, section 3.4.

use super::config::AttitudeConfig;
use super::low_pass::LowPass;
use stampfly_types::Vec3;

/// Largest change of the mean rate while the rest time runs, rad/s: 0.3°/s, ten times the averaged
/// noise of a small gyro.
const EVEN: f32 = 0.3 * core::f32::consts::PI / 180.0;

/// Detector of a stationary body.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct StationaryDetector {
    gyro: LowPass<3>,
    accel: LowPass<3>,
    quiet_for: f32,
    /// Mean rate at the time when it became quiet.
    first: Vec3,
}

impl StationaryDetector {
    pub fn new(config: &AttitudeConfig) -> Self {
        let low_pass = LowPass::new(config.rest_filter_time);
        Self { gyro: low_pass, accel: low_pass, quiet_for: 0.0, first: Vec3::zeros() }
    }

    /// Takes an inertial sample. `calibrated` is the gyro bias of the start.
    pub fn step(&mut self, config: &AttitudeConfig, accel: &Vec3, gyro: &Vec3, calibrated: &Vec3, dt: f32) {
        self.gyro.step(&(*gyro).into(), dt);
        self.accel.step(&(*accel).into(), dt);
        let quiet = (gyro - self.rate()).norm() < config.rest_rate
            && (accel - Vec3::from(*self.accel.value())).norm() < config.rest_force
            && (self.rate() - calibrated).amax() < config.bias_limit;
        if self.quiet_for <= 0.0 {
            self.first = self.rate();
        }
        // A bias is constant over the rest time; a changing rate is motion.
        let even = self.quiet_for >= config.rest_time || (self.rate() - self.first).norm() < EVEN;
        self.quiet_for = if quiet && even { (self.quiet_for + dt).min(config.rest_time) } else { 0.0 };
    }

    /// Ends a rest that proved false.
    pub fn end(&mut self) {
        self.quiet_for = 0.0;
    }

    /// Whether it is quiet, for however short a time.
    pub fn is_quiet(&self) -> bool {
        self.quiet_for > 0.0
    }

    /// Whether it has been quiet for the rest time.
    pub fn is_stationary(&self, config: &AttitudeConfig) -> bool {
        self.quiet_for >= config.rest_time
    }

    /// Low-passed rate, rad/s.
    pub fn rate(&self) -> Vec3 {
        (*self.gyro.value()).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::GRAVITY;

    /// Time until a stationary body is detected, s; `None` after five seconds.
    fn detected_after(rate: impl Fn(u16) -> f32, force: impl Fn(u16) -> f32) -> Option<f32> {
        let config = AttitudeConfig::default();
        let mut detector = StationaryDetector::new(&config);
        (0..2_000u16).find_map(|step| {
            let accel = Vec3::new(force(step), 0.0, -GRAVITY);
            detector.step(&config, &accel, &Vec3::new(0.0, rate(step), 0.0), &Vec3::zeros(), 0.0025);
            detector.is_stationary(&config).then(|| f32::from(step) * 0.0025)
        })
    }

    fn noise(step: u16) -> f32 {
        f32::from(step * 7 % 13) / 6.0 - 1.0
    }

    #[test]
    fn a_stationary_body_is_detected_in_time_and_motion_is_not() {
        let time = AttitudeConfig::default().rest_time;
        let after = detected_after(|step| 0.01 + 0.005 * noise(step), |step| 0.1 * noise(step)).unwrap();
        assert!(after >= time - 0.01 && after < time + 0.6, "{after} s");
        assert!(detected_after(|step| 0.2 * noise(step / 40), |_| 0.0).is_none(), "a trembling hand");
        assert!(detected_after(|_| 0.0, |step| 1.5 * noise(step)).is_none(), "a running motor");
        assert!(detected_after(|_| 0.2, |_| 0.0).is_none(), "a steady turn");
    }
}
