//! Heading from the magnetic field: a one-state Kalman filter.
//!
//! The gyro's heading drifts with its bias uncertainty. An indoor field is distorted by some
//! degrees, differently every second or two. The filter weighs the two by their uncertainties, so
//! that a calibrated gyro follows the field over most of a minute and an uncalibrated one within
//! seconds. A disturbed field has little weight and matters only after the gyro alone has become
//! less certain than it.
//!
//! When another field becomes the reference, its direction disagrees with the heading. The two
//! variances divide the disagreement: the heading takes its share at once, the rest becomes the
//! declination of the new place. When the first field returns, the declination is dropped.

use super::config::AttitudeConfig;
use stampfly_types::{Vec3, math};

/// Correlation time of the bias error, s. It makes a random walk of the heading error.
const BIAS_TIME: f32 = 10.0;
/// Scale error of the gyro, as a share, and the time for which a hand turns in one direction, s.
const SCALE_ERROR: f32 = 0.002;
const TURN_TIME: f32 = 0.5;
/// Correlation time of the field distortion at rest, s.
const REST_TIME: f32 = 30.0;
/// Largest variance, rad²: the heading is unknown.
const MAX_VARIANCE: f32 = 3.0;

/// Heading of the level frame in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Heading {
    /// Direction of the horizontal part of the reference field in the world, rad.
    north: f32,
    /// Direction of the present reference relative to the first one, rad.
    declination: f32,
    value: f32,
    variance: f32,
    /// Disagreement of the last field, rad.
    off: f32,
}

impl Heading {
    /// Unknown heading; north is where the field points.
    pub fn unknown() -> Self {
        Self { north: 0.0, declination: 0.0, value: 0.0, variance: MAX_VARIANCE, off: 0.0 }
    }

    /// Heading zero by definition, with this field in the level frame. `sigma` is the direction
    /// error of the field, rad.
    pub fn defined_by(field: &Vec3, sigma: f32) -> Self {
        Self { north: math::atan2(field.y, field.x), variance: sigma * sigma, ..Self::unknown() }
    }

    /// Rotation from the level frame to the world about the vertical, rad.
    pub fn value(&self) -> f32 {
        self.value
    }

    /// Standard deviation, rad.
    pub fn sigma(&self) -> f32 {
        math::sqrt(self.variance)
    }

    /// Disagreement of the last field, rad.
    pub fn innovation(&self) -> f32 {
        self.off
    }

    /// Propagates the variance with a gyro bias error of `bias_sigma` and a scale error at `rate`,
    /// rad/s.
    pub fn predict(&mut self, bias_sigma: f32, rate: f32, dt: f32) {
        let scale = SCALE_ERROR * rate;
        let walk = bias_sigma * bias_sigma * BIAS_TIME + scale * scale * TURN_TIME;
        self.variance = (self.variance + walk * dt).min(MAX_VARIANCE);
    }

    /// Adds a field error with this standard deviation, rad, to the variance.
    pub fn inflate(&mut self, sigma: f32) {
        self.variance = (self.variance + sigma * sigma).min(MAX_VARIANCE);
    }

    /// The first reference is valid again.
    pub fn clear_declination(&mut self) {
        self.declination = 0.0;
    }

    /// Another field, in the level frame, becomes the reference.
    pub fn change_reference(&mut self, config: &AttitudeConfig, field: &Vec3) {
        self.declination = 0.0;
        let off = self.disagreement(field);
        let share = self.share(config);
        self.value = math::wrap_angle(self.value - share * off);
        self.declination = (1.0 - share) * off;
        self.variance *= 1.0 - share;
    }

    /// Update with a field in the level frame whose direction error is `sigma`, rad. Returns the
    /// share of the disagreement that went into the heading, and the disagreement, rad.
    ///
    /// At rest the distortion is the same in every sample, so the variance does not decrease.
    pub fn update(
        &mut self,
        config: &AttitudeConfig,
        field: &Vec3,
        sigma: f32,
        stationary: bool,
        dt: f32,
    ) -> (f32, f32) {
        let off = self.disagreement(field);
        self.off = off;
        // A disagreement beyond the heading's uncertainty must be distortion: enlarge its standard
        // deviation.
        let sigma = sigma.max(off.abs() * (1.0 - self.share(config)));
        let time = if stationary { REST_TIME } else { config.field_time };
        let noise = sigma * sigma * (time / dt).max(1.0);
        let share = self.variance / (self.variance + noise);
        self.value = math::wrap_angle(self.value - share * off);
        // At rest every sample has the same distortion: do not become more certain than it.
        let least = if stationary { self.variance.min(config.mag_start_sigma * config.mag_start_sigma) } else { 0.0 };
        self.variance = (self.variance * (1.0 - share)).max(least);
        (share, off)
    }

    /// Share of the heading in a disagreement with a field of unknown direction.
    fn share(&self, config: &AttitudeConfig) -> f32 {
        self.variance / (self.variance + config.mag_place_sigma * config.mag_place_sigma)
    }

    /// Angle by which the field points too far east, rad.
    fn disagreement(&self, field: &Vec3) -> f32 {
        math::wrap_angle(math::atan2(field.y, field.x) + self.value - self.north - self.declination)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    const DT: f32 = 0.01;
    const DEGREE: f32 = math::PI / 180.0;

    /// A field that points this many degrees east of north.
    fn pointing(east: f32) -> Vec3 {
        Vec3::new(16.0 * math::cos(east * DEGREE), 16.0 * math::sin(east * DEGREE), 42.0)
    }

    fn settled() -> (AttitudeConfig, Heading) {
        let config = AttitudeConfig::default();
        let mut heading = Heading::defined_by(&pointing(0.0), config.mag_start_sigma);
        for _ in 0..2_000 {
            heading.predict(config.rest_bias_sigma, 0.5, DT);
            heading.update(&config, &pointing(0.0), config.mag_sigma, false, DT);
        }
        (config, heading)
    }

    #[test]
    fn a_known_gyro_follows_slowly_and_an_unknown_one_fast() {
        let after = |bias_sigma: f32| {
            let (config, mut heading) = settled();
            for _ in 0..500 {
                heading.predict(bias_sigma, 0.5, DT);
                heading.update(&config, &pointing(4.0), config.mag_sigma, false, DT);
            }
            -heading.value() / DEGREE
        };
        let (known, unknown) = (after(0.03 * DEGREE), after(0.5 * DEGREE));
        assert!(known < 1.5 && unknown > 2.5 && unknown <= 4.0, "{known}° and {unknown}° of 4°");
    }

    #[test]
    fn a_stationary_body_does_not_reduce_the_variance() {
        let config = AttitudeConfig::default();
        let mut heading = Heading::defined_by(&pointing(0.0), config.mag_start_sigma);
        for _ in 0..6_000 {
            heading.predict(0.0, 0.0, DT);
            heading.update(&config, &pointing(0.0), config.mag_sigma, true, DT);
        }
        assert_abs_diff_eq!(heading.sigma() / config.mag_start_sigma, 1.0, epsilon = 1e-3);
    }

    #[test]
    fn the_declination_of_another_place_is_cleared_at_the_first_one() {
        let (config, mut heading) = settled();
        heading.change_reference(&config, &pointing(50.0));
        assert!(heading.value().abs() < 2.0 * DEGREE, "{}", heading.value());
        let (_, off) = heading.update(&config, &pointing(50.0), config.mag_sigma, false, DT);
        assert!(off.abs() < 1e-3, "{off}");
        heading.clear_declination();
        let (_, off) = heading.update(&config, &pointing(0.0), config.mag_sigma, false, DT);
        assert!(off.abs() < 2.0 * DEGREE, "{off}");
    }

    #[test]
    fn an_unknown_heading_follows_the_field() {
        let config = AttitudeConfig::default();
        let mut heading = Heading::unknown();
        for _ in 0..100 {
            heading.update(&config, &pointing(-170.0), config.mag_sigma, false, DT);
        }
        assert_abs_diff_eq!(heading.value() / DEGREE, 170.0, epsilon = 1.0);
    }
}
