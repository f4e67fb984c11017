//! Gyro bias at rest and in motion: a three-state Kalman filter.
//!
//! At rest the gyro measures its bias. In motion gravity does: the attitude drifts with the bias,
//! the filtered specific force tilts with the attitude, and the rate of that tilt is the low-passed
//! effect of the bias on the two level axes. With R the rotation into the level frame and LP the
//! filter of the specific force:
//!
//! > tilt rate = LP(R·(b − b̂)), so LP(R)·b = tilt rate + LP(R·b̂)
//!
//! Gravity has no information about the vertical axis. There a weak update pulls the bias to its
//! calibrated value, and in a clean magnetic field the heading corrections measure it
//! (`update_vertical`).
//!
//! After Laidig, Seel, "VQF", Information Fusion 91, 2023, section 3.3. The tilt rate is the
//! filter's own derivative instead of the corrections of single samples, which in `f32` would be
//! mostly rounding error.

use super::config::AttitudeConfig;
use super::low_pass::LowPass;
use nalgebra::{Matrix3, SVector, Vector3};
use stampfly_types::Vec3;

/// Weight of the pull on the vertical axis, relative to that of a level axis.
const VERTICAL_WEIGHT: f32 = 1e-4;

/// Smallest share of clean fields in the averaged heading corrections for an update of the bias.
const CLEAN: f32 = 0.8;

/// A stored bias with its covariance, to be restored later.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct KnownBias {
    value: Vec3,
    /// Upper triangle of the covariance, row by row.
    upper: [f32; 6],
}

impl KnownBias {
    /// The bias, body, rad/s.
    pub fn value(&self) -> Vec3 {
        self.value
    }

    /// Standard deviation of the least certain axis, rad/s.
    pub fn sigma(&self) -> f32 {
        let [x, _, _, y, _, z] = self.upper;
        stampfly_types::math::sqrt(x.max(y).max(z))
    }
}

/// Estimator of the gyro bias.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct GyroBias {
    value: Vec3,
    calibrated: Vec3,
    covariance: Matrix3<f32>,
    /// Rotation into the level frame in row order, then the level part of the rotated bias;
    /// low-passed.
    rotated: LowPass<11>,
    /// Vertical row of that rotation and vertical part of the bias, averaged like the heading
    /// correction.
    vertical: Vec3,
    vertical_bias: f32,
    /// Share of that average that comes from clean fields.
    clean: f32,
}

impl GyroBias {
    /// Starts from a calibrated bias and its standard deviation, rad/s.
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

    /// The present bias and covariance.
    pub fn known(&self) -> KnownBias {
        let [[xx, _, _], [xy, yy, _], [xz, yz, zz]] = self.covariance.data.0;
        KnownBias { value: self.value, upper: [xx, xy, xz, yy, yz, zz] }
    }

    /// Restores a stored bias and covariance.
    pub fn restore(&mut self, known: &KnownBias) {
        let [xx, xy, xz, yy, yz, zz] = known.upper;
        self.value = known.value;
        self.covariance = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    }

    /// The calibrated bias, body, rad/s.
    pub fn calibrated(&self) -> &Vec3 {
        &self.calibrated
    }

    /// Standard deviation of the least certain axis, rad/s.
    pub fn sigma(&self) -> f32 {
        stampfly_types::math::sqrt(self.covariance.diagonal().max())
    }

    /// Standard deviation along a body axis of unit length, rad/s.
    pub fn sigma_along(&self, axis: &Vec3) -> f32 {
        stampfly_types::math::sqrt(axis.dot(&(self.covariance * *axis)))
    }

    /// Propagates the variance by the random walk. Also updates the low-pass for
    /// [`update_moving`](Self::update_moving), so call it at rest, too.
    pub fn predict(&mut self, config: &AttitudeConfig, level: &Matrix3<f32>, dt: f32) {
        let limit = config.initial_bias_sigma * config.initial_bias_sigma;
        for axis in 0..3 {
            if let Some(variance) = self.covariance.get_mut((axis, axis)) {
                // A variance that starts above the limit stays, but does not grow.
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

    /// Update in motion. `leaning` are the tilt rates of the filtered specific force about level x
    /// and y, rad/s.
    pub fn update_moving(&mut self, config: &AttitudeConfig, leaning: [f32; 2], dt: f32) {
        if !self.rotated.is_settled() {
            return;
        }
        let &[r11, r12, r13, r21, r22, r23, r31, r32, r33, bx, by] = self.rotated.value().as_ref();
        let noise = noise(config, config.motion_bias_sigma, dt);
        let [x, y] = leaning;
        // Two level axes from the tilt rate; the vertical one is only pulled to the calibration.
        self.update(config, &Vec3::new(r11, r12, r13), x + bx, noise);
        self.update(config, &Vec3::new(r21, r22, r23), y + by, noise);
        let vertical = Vec3::new(r31, r32, r33);
        self.update(config, &vertical, vertical.dot(&self.calibrated), noise / VERTICAL_WEIGHT);
    }

    /// Update of the vertical axis in motion: a clean field corrected the heading by `share` of a
    /// disagreement of `off` rad. Repeated corrections of one sign measure the drift of the
    /// heading, as the tilt rate does for the level axes.
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

    /// Reduces the weight of past corrections by `share`, after a correction that was not due to
    /// drift.
    pub fn interrupt(&mut self, share: f32) {
        self.clean -= self.clean * share.clamp(0.0, 1.0);
    }

    /// Scalar measurement `row · bias = measured`.
    fn update(&mut self, config: &AttitudeConfig, row: &Vec3, measured: f32, noise: f32) {
        let row = Vector3::from(*row);
        let spread = self.covariance * row;
        let gain = spread / (row.dot(&spread) + noise);
        // Not `clamp`, which panics if a configured limit is negative or NaN.
        let limited = |part: f32| part.max(-config.bias_limit).min(config.bias_limit);
        self.value += Vec3::from(gain * limited(measured - row.dot(&self.value.into())));
        self.covariance -= gain * spread.transpose();
        let off = (self.value - self.calibrated).map(limited);
        self.value = self.calibrated + off;
    }
}

/// Measurement variance with which the filter settles at `sigma`, for any sampling rate.
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
