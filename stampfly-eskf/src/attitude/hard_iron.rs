//! Hard iron estimated in motion: the field of magnetised parts that turn with the sensor.
//!
//! A screw, a speaker or a battery current adds a constant to the field in the *body*; the earth's
//! field is constant in the *world*. With the rotation R into the level frame, known from gyro and
//! gravity without a magnetometer, a sample in that frame is
//!
//! > R·measured = field + R·offset + variation
//!
//! which is linear in both unknowns: a Kalman filter of six states. For a body at rest only the sum
//! is observable, which the covariance represents. Heading drift appears as a random walk of the
//! field. Indoors the world's field varies in space, and the variation is correlated over about a
//! second, so the samples of a second together count as one.
//!
//! Not for soft iron (see [`EllipsoidFit`](crate::calibration::EllipsoidFit)), and unable to
//! distinguish a magnet on the sensor from one next to it while nothing turns.

use super::config::AttitudeConfig;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use stampfly_types::Vec3;

/// Squared distance, in variances, beyond which a component of a sample is an outlier.
const GATE: f32 = 16.0;
/// Time of consecutive outliers after which the random walks are enlarged, s.
const LOCKOUT: f32 = 3.0;
/// Averaging time of the strength statistics, s.
const WATCH: f32 = 15.0;
/// The offset is used once it reduces the variance of the strength to this share, and dropped above
/// the second one.
const USED_BELOW: f32 = 0.5;
const DROPPED_ABOVE: f32 = 0.8;

/// Running mean and variance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Spread {
    mean: f32,
    variance: f32,
}

impl Spread {
    fn add(&mut self, value: f32, share: f32) {
        let off = value - self.mean;
        self.mean += off * share;
        self.variance += (off * off * (1.0 - share) - self.variance) * share;
    }
}

/// Estimator of the offset.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct HardIron {
    /// World field in the level frame, then offset in the body, µT.
    state: SVector<f32, 6>,
    covariance: SMatrix<f32, 6, 6>,
    outliers_for: f32,
    started: bool,
    /// Time of statistics so far, s.
    watched: f32,
    /// Strength of the field as measured, and without the offset.
    strength: [Spread; 2],
    used: bool,
}

impl HardIron {
    pub fn new(config: &AttitudeConfig) -> Self {
        let offset = config.hard_iron_sigma * config.hard_iron_sigma;
        let far = 1e4;
        Self {
            state: SVector::zeros(),
            covariance: SMatrix::from_diagonal(&SVector::from([far, far, far, offset, offset, offset])),
            outliers_for: 0.0,
            started: false,
            watched: 0.0,
            strength: [Spread::default(); 2],
            used: false,
        }
    }

    /// Offset to subtract from samples, body, µT: the estimate, shortened by its uncertainty.
    pub fn offset(&self, config: &AttitudeConfig) -> Vec3 {
        if !self.used {
            return Vec3::zeros();
        }
        let offset = self.iron();
        let variance = self.covariance.diagonal().fixed_rows::<3>(3).sum();
        let chance = config.hard_iron_least * config.hard_iron_least + variance;
        // Positive-part James-Stein estimator: zero while the offset is not longer than its
        // standard deviation.
        offset * (1.0 - chance / offset.norm_squared().max(1e-6)).max(0.0)
    }

    /// The world's field in the level frame, µT.
    pub fn field(&self) -> Vec3 {
        self.state.fixed_rows::<3>(0).into_owned().into()
    }

    /// The estimated offset, body, µT.
    fn iron(&self) -> Vec3 {
        self.state.fixed_rows::<3>(3).into_owned().into()
    }

    /// Tests whether the offset explains the changes of the strength. Call it only while the body
    /// turns.
    fn watch(&mut self, field: &Vec3, dt: f32) {
        self.watched = (self.watched + dt).min(WATCH);
        let share = (dt / self.watched).min(1.0);
        let without = field - self.iron();
        for (spread, value) in self.strength.iter_mut().zip([field.norm(), without.norm()]) {
            spread.add(value, share);
        }
        let [raw, without] = self.strength.map(|spread| spread.variance);
        let limit = if self.used { DROPPED_ABOVE } else { USED_BELOW };
        self.used = self.watched > 0.2 * WATCH && without < limit * raw;
    }

    /// Takes a field, body, µT, `dt` seconds after the last one, with the rotation into the level
    /// frame.
    pub fn step(&mut self, config: &AttitudeConfig, level: &Matrix3<f32>, field: &Vec3, turning: bool, dt: f32) {
        let turned = level * Vector3::from(*field);
        if turning {
            self.watch(field, dt);
        }
        if !self.started {
            self.started = true;
            self.state.fixed_rows_mut::<3>(0).copy_from(&turned);
        }
        let walk = |sigma: f32| sigma * sigma * dt;
        // After a lock-out the walks grow, until a moved magnet passes the outlier test again.
        let patience = if self.outliers_for > LOCKOUT { 400.0 } else { 1.0 };
        let walks = [walk(config.field_walk), walk(config.hard_iron_walk)].map(|walk| walk * patience);
        for state in 0..6 {
            if let Some(variance) = self.covariance.get_mut((state, state)) {
                let [field, offset] = walks;
                *variance += if state < 3 { field } else { offset };
                *variance = variance.min(1e4);
            }
        }
        let rows = [0usize, 1, 2].map(|axis| {
            let mut row = SVector::<f32, 6>::zeros();
            if let Some(own) = row.get_mut(axis) {
                *own = 1.0;
            }
            row.fixed_rows_mut::<3>(3).copy_from(&level.row(axis).transpose());
            row
        });
        let single = config.field_sigma * config.field_sigma;
        let outlier = rows.iter().zip(turned.iter()).any(|(row, measured)| {
            let off = measured - row.dot(&self.state);
            off * off > GATE * (row.dot(&(self.covariance * row)) + single)
        });
        if outlier {
            self.outliers_for += dt;
            return;
        }
        self.outliers_for = 0.0;
        // Correlated samples: weigh them as one per `field_time`.
        let noise = single * (config.field_time / dt).max(1.0);
        for (row, measured) in rows.iter().zip(turned.iter()) {
            let spread = self.covariance * row;
            let gain = spread / (row.dot(&spread) + noise);
            self.state += gain * (measured - row.dot(&self.state));
            self.covariance -= gain * spread.transpose();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::{Quat, math};

    const EARTH: Vec3 = Vec3::new(16.0, 0.0, 42.0);
    const DT: f32 = 0.01;

    /// `time` seconds in a field with this offset, turning about all axes by ±`swing` rad.
    fn seconds(hard_iron: &mut HardIron, time: f32, offset: Vec3, swing: f32) {
        let config = AttitudeConfig::default();
        for step in 0..(time / DT) as u32 {
            let t = step as f32 * DT;
            let [a, b, c] = [1.1, 1.7, 0.4].map(|rate| swing * math::sin(rate * t));
            let attitude = Quat::from_euler_angles(a, b, 2.0 * c);
            let field = attitude.inverse() * EARTH + offset;
            hard_iron.step(&config, &attitude.into(), &field, swing > 0.0, DT);
        }
    }

    #[test]
    fn hard_iron_is_found_by_turning_and_not_while_stationary() {
        let config = AttitudeConfig::default();
        let offset = Vec3::new(10.0, -20.0, 5.0);
        let mut hard_iron = HardIron::new(&config);
        seconds(&mut hard_iron, 60.0, offset, 0.0);
        assert_eq!(hard_iron.offset(&config), Vec3::zeros());
        seconds(&mut hard_iron, 30.0, offset, 0.8);
        assert!((hard_iron.offset(&config) - offset).norm() < 1.0, "{:?}", hard_iron.offset(&config));
        assert!((hard_iron.field() - EARTH).norm() < 1.0, "{:?}", hard_iron.field());
    }

    #[test]
    fn a_magnet_that_is_put_on_later_is_found_too() {
        let config = AttitudeConfig::default();
        let mut hard_iron = HardIron::new(&config);
        seconds(&mut hard_iron, 60.0, Vec3::zeros(), 0.8);
        assert_eq!(hard_iron.offset(&config), Vec3::zeros());
        let offset = Vec3::new(0.0, 15.0, -15.0);
        seconds(&mut hard_iron, 60.0, offset, 0.8);
        assert!((hard_iron.offset(&config) - offset).norm() < 2.0, "{:?}", hard_iron.offset(&config));
    }

    #[test]
    fn the_covariance_stays_positive_over_an_hour() {
        let config = AttitudeConfig::default();
        let mut hard_iron = HardIron::new(&config);
        for round in 0..36u8 {
            seconds(&mut hard_iron, 100.0, Vec3::new(f32::from(round % 3) * 9.0, 0.0, 0.0), 0.4);
            assert!(hard_iron.covariance.symmetric_eigenvalues().min() > 0.0, "{}", hard_iron.covariance);
        }
    }
}
