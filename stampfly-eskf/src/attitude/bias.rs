//! The gyro's bias, at rest and in motion: a Kalman filter of three states.
//!
//! At rest the gyro shows it. In motion gravity does: the attitude drifts with the bias, the filtered specific force
//! leans over with the attitude, and the rate at which it leans is what the bias does to the two level axes,
//! low-passed. With R the rotation into the level frame and LP the filter of the specific force:
//!
//! > rate of leaning = LP(R·(b − b̂)), so LP(R)·b = rate of leaning + LP(R·b̂)
//!
//! Of the vertical axis gravity says nothing. There the bias is drawn, very gently, to where the calibration had it;
//! the vertical axis is also what a clean magnetic field keeps turning the heading back by (`update_vertical`).
//!
//! After Laidig, Seel, "VQF", Information Fusion 91, 2023, section 3.3; the leaning rate is taken from the filter's own
//! derivative instead of the corrections of single samples, which in `f32` would be mostly rounding.

use super::config::AttitudeConfig;
use super::low_pass::LowPass;
use nalgebra::{Matrix3, SVector, Vector3};
use stampfly_types::Vec3;

/// Share of the weight of a level axis that the pull on the vertical one has.
const VERTICAL_WEIGHT: f32 = 1e-4;

/// The heading's drift updates the bias when it comes from clean fields by more than this share.
const CLEAN: f32 = 0.8;

/// A bias and how well it is known, to go back to.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct KnownBias {
    value: Vec3,
    /// The covariance's upper triangle: row by row.
    upper: [f32; 6],
}

impl KnownBias {
    /// The bias, body, rad/s.
    pub fn value(&self) -> Vec3 {
        self.value
    }

    /// One standard deviation of the worst axis, rad/s.
    pub fn sigma(&self) -> f32 {
        let [x, _, _, y, _, z] = self.upper;
        stampfly_types::math::sqrt(x.max(y).max(z))
    }
}

/// Estimates the gyro's bias.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct GyroBias {
    value: Vec3,
    calibrated: Vec3,
    covariance: Matrix3<f32>,
    /// Rotation into the level frame in row order, then the level part of the rotated bias.
    rotated: LowPass<11>,
    /// Vertical row of that rotation and vertical part of the bias, averaged as the heading correction averages.
    vertical: Vec3,
    vertical_bias: f32,
    /// Share of that average that was corrected by clean fields.
    clean: f32,
}

impl GyroBias {
    /// Starts from a calibration: its bias, and how well it is known, rad/s.
    pub fn new(config: &AttitudeConfig, calibrated: Vec3, sigma: f32) -> Self {
        Self {
            value: calibrated,
            calibrated,
            covariance: Matrix3::identity() * (sigma * sigma),
            rotated: LowPass::new(config.accel_time),
            vertical: Vec3::zeros(),
            vertical_bias: 0.0,
            clean: 0.0,
        }
    }

    /// The bias, body, rad/s.
    pub fn value(&self) -> Vec3 {
        self.value
    }

    /// What is known now.
    pub fn known(&self) -> KnownBias {
        let [[xx, _, _], [xy, yy, _], [xz, yz, zz]] = self.covariance.data.0;
        KnownBias { value: self.value, upper: [xx, xy, xz, yy, yz, zz] }
    }

    /// Goes back to what was known.
    pub fn restore(&mut self, known: &KnownBias) {
        let [xx, xy, xz, yy, yz, zz] = known.upper;
        self.value = known.value;
        self.covariance = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    }

    /// What the start knew, body, rad/s.
    pub fn calibrated(&self) -> &Vec3 {
        &self.calibrated
    }

    /// One standard deviation of the worst axis, rad/s.
    pub fn sigma(&self) -> f32 {
        stampfly_types::math::sqrt(self.covariance.diagonal().max())
    }

    /// One standard deviation along an axis of the body, rad/s.
    pub fn sigma_along(&self, axis: &Vec3) -> f32 {
        stampfly_types::math::sqrt(axis.dot(&(self.covariance * *axis)))
    }

    /// Propagates the variance by the bias' random walk. Also keeps what [`update_moving`](Self::update_moving) needs,
    /// at rest as well.
    pub fn predict(&mut self, config: &AttitudeConfig, level: &Matrix3<f32>, dt: f32) {
        let limit = config.initial_bias_sigma * config.initial_bias_sigma;
        for axis in 0..3 {
            if let Some(variance) = self.covariance.get_mut((axis, axis)) {
                // A variance that the calibration left above the limit stays; it does not grow.
                *variance = (*variance + config.bias_walk * config.bias_walk * dt).min(limit.max(*variance));
            }
        }
        let turned = level * self.value;
        let rows = level.row_iter().flat_map(|row| [row[0], row[1], row[2]]);
        let channels = rows.chain([turned.x, turned.y]);
        self.rotated.step(&SVector::<f32, 11>::from_iterator(channels), dt);
    }

    /// Update while stationary: the gyro measures its bias.
    pub fn update_stationary(&mut self, config: &AttitudeConfig, rate: &Vec3, dt: f32) {
        let noise = noise(config, config.rest_bias_sigma, dt);
        for (axis, shown) in [Vec3::x(), Vec3::y(), Vec3::z()].iter().zip(rate.iter()) {
            self.update(config, axis, *shown, noise);
        }
    }

    /// Update in motion: the filtered specific force leans over at these rates about the level frame's x and y.
    pub fn update_moving(&mut self, config: &AttitudeConfig, leaning: [f32; 2], dt: f32) {
        if !self.rotated.is_settled() {
            return;
        }
        let &[r11, r12, r13, r21, r22, r23, r31, r32, r33, bx, by] = self.rotated.value().as_ref();
        let noise = noise(config, config.motion_bias_sigma, dt);
        let [x, y] = leaning;
        self.update(config, &Vec3::new(r11, r12, r13), x + bx, noise);
        self.update(config, &Vec3::new(r21, r22, r23), y + by, noise);
        let vertical = Vec3::new(r31, r32, r33);
        self.update(config, &vertical, vertical.dot(&self.calibrated), noise / VERTICAL_WEIGHT);
    }

    /// Update of the vertical axis in motion: a clean field turned the heading by `share` of a disagreement of `off`
    /// rad. A heading that keeps being turned the same way drifts: to the averaging of the correction this is what
    /// leaning is to that of the force.
    pub fn update_vertical(&mut self, config: &AttitudeConfig, vertical: &Vec3, share: f32, off: f32, dt: f32) {
        self.vertical += (vertical - self.vertical) * share;
        self.vertical_bias += (vertical.dot(&self.value) - self.vertical_bias) * share;
        self.clean += (1.0 - self.clean) * share;
        if self.clean > CLEAN {
            let row = self.vertical;
            let noise = noise(config, config.mag_bias_sigma, dt);
            self.update(config, &row, share * off / dt + self.vertical_bias, noise);
        }
    }

    /// The heading was not corrected, or by something else than its drift.
    pub fn interrupt(&mut self, share: f32) {
        self.clean -= self.clean * share.clamp(0.0, 1.0);
    }

    /// The scalar measurement `row · bias = measured`.
    fn update(&mut self, config: &AttitudeConfig, row: &Vec3, measured: f32, noise: f32) {
        let row = Vector3::from(*row);
        let spread = self.covariance * row;
        let gain = spread / (row.dot(&spread) + noise);
        // Not `clamp`, which panics when a configured limit is negative or no number.
        let limited = |part: f32| part.max(-config.bias_limit).min(config.bias_limit);
        self.value += Vec3::from(gain * limited(measured - row.dot(&self.value.into())));
        self.covariance -= gain * spread.transpose();
        let off = (self.value - self.calibrated).map(limited);
        self.value = self.calibrated + off;
    }
}

/// Variance of a measurement such that the filter settles at `sigma`, whatever the sampling rate.
fn noise(config: &AttitudeConfig, sigma: f32, dt: f32) -> f32 {
    let variance = sigma * sigma;
    variance * variance / (config.bias_walk * config.bias_walk * dt) + variance
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    const DT: f32 = 0.0025;

    #[test]
    fn stationary_updates_find_the_bias_and_settle_at_the_configured_sigma() {
        let config = AttitudeConfig::default();
        let mut bias = GyroBias::new(&config, Vec3::zeros(), config.initial_bias_sigma);
        let truth = Vec3::new(0.01, -0.02, 0.015);
        for _ in 0..20_000 {
            bias.predict(&config, &Matrix3::identity(), DT);
            bias.update_stationary(&config, &truth, DT);
        }
        assert!((bias.value() - truth).amax() < 2e-4, "{:?}", bias.value());
        assert_abs_diff_eq!(bias.sigma() / config.rest_bias_sigma, 1.0, epsilon = 0.1);
    }

    #[test]
    fn no_update_moves_the_bias_beyond_its_limit() {
        let config = AttitudeConfig::default();
        let calibrated = Vec3::new(0.5, 0.0, 0.0);
        let mut bias = GyroBias::new(&config, calibrated, config.initial_bias_sigma);
        for step in 0..4_000u16 {
            bias.predict(&config, &Matrix3::identity(), DT);
            bias.update_moving(&config, [f32::from(step), -1e6], DT);
        }
        assert!((bias.value() - calibrated).amax() <= config.bias_limit * 1.001, "{:?}", bias.value());
    }

    #[test]
    fn the_covariance_stays_positive_over_hours() {
        let config = AttitudeConfig::default();
        let mut bias = GyroBias::new(&config, Vec3::zeros(), config.initial_bias_sigma);
        for step in 0..1_000_000u32 {
            bias.predict(&config, &Matrix3::identity(), DT);
            if step % 4_000 < 2_000 {
                bias.update_stationary(&config, &Vec3::zeros(), DT);
            } else {
                bias.update_moving(&config, [0.0; 2], DT);
            }
        }
        assert!(bias.covariance.symmetric_eigenvalues().min() > 0.0, "{}", bias.covariance);
        assert!((bias.covariance - bias.covariance.transpose()).amax() < 1e-3 * bias.covariance.amax());
    }
}
