//! Attitude filter for gyro, accelerometer and optional magnetometer.
//!
//! Use it for a body without a position sensor: a handheld device, a head tracker, a rover or
//! glider, or as the fallback of a flying vehicle. Not for a vehicle with measured velocity: the
//! [`Eskf`](crate::Eskf) can separate acceleration from gravity.
//!
//! The attitude is the product of three rotations, each from one sensor:
//!
//! | rotation | source | changes |
//! |---|---|---|
//! | body → drifting | gyro without bias | with every sample |
//! | drifting → level | specific force, low-passed in the drifting frame | slowly |
//! | level → world | magnetic field without hard iron, if undisturbed | slowly, vertical axis only |
//!
//! The drifting frame hardly rotates, so acceleration is averaged over seconds however fast the
//! body turns. The magnetometer affects the tilt only through the gyro bias.
//!
//! Structure after Laidig, Seel, "VQF: Highly accurate IMU orientation estimation with bias
//! estimation and magnetic disturbance rejection", Information Fusion 91, 2023. Different here:
//! sensor delays, hard iron estimated in motion, a heading gain from the uncertainties of gyro and
//! field, the vertical gyro bias from the field, the return from another place, formulas that are
//! accurate in `f32`, steps of any length.

mod field;

use super::bias::GyroBias;
use super::bookkeeping::Bookkeeping;
use super::config::AttitudeConfig;
use super::delay::MagDelay;
use super::hard_iron::HardIron;
use super::heading::Heading;
use super::low_pass::LowPass;
use super::magnetic::Magnetic;
use super::rotation::{from_vector, product, upwards, within};
use super::stationary::StationaryDetector;
use super::witness::Witness;
use crate::level::attitude_from_specific_force;
use nalgebra::Matrix3;
use stampfly_types::messages::CalibrationResult;
use stampfly_types::{Quat, Vec3, frame};

/// Largest plausible samples: rad/s, m/s², µT. Larger ones are transmission errors.
const LARGEST_RATE: f32 = 200.0;
const LARGEST_FORCE: f32 = 2_000.0;
const LARGEST_FIELD: f32 = 10_000.0;
/// Largest plausible gyro bias, rad/s. A calibration with more was made in motion.
const LARGEST_BIAS: f32 = 0.5;
/// Longest step that is integrated, s. Longer ones are shortened to it.
const LONGEST_STEP: f32 = 0.5;
/// Standard deviation of a heading that was defined in motion, rad.
const MOVING_START_SIGMA: f32 = 1.0;

/// Attitude from gyro, accelerometer and, if present, magnetometer. See [`step`](Self::step) for
/// the units and [`Estimator`](crate::Estimator) for use with time stamps.
///
/// ```
/// use stampfly_eskf::attitude::{AttitudeConfig, AttitudeFilter};
/// use stampfly_types::{Vec3, frame};
///
/// let mut filter = AttitudeFilter::new(AttitudeConfig::default());
/// // Level and still; the field points 45° to the right of the nose, and down.
/// for _ in 0..100 {
///     filter.step(&Vec3::new(0.0, 0.0, -9.81), &Vec3::zeros(), 0.01);
///     filter.field(&Vec3::new(15.0, 15.0, 40.0), 0.0, 0.01);
/// }
/// let [roll, pitch, yaw] = frame::roll_pitch_yaw(&filter.attitude());
/// assert!(roll.abs() < 1e-3 && pitch.abs() < 1e-3);
/// assert!((yaw.to_degrees() + 45.0).abs() < 0.1);
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AttitudeFilter {
    pub(super) config: AttitudeConfig,
    /// Body → drifting.
    strapdown: Quat,
    /// Drifting → level.
    level: Quat,
    /// Specific force in the drifting frame, low-passed.
    force: LowPass<3>,
    bias: GyroBias,
    stationary: StationaryDetector,
    witness: Witness,
    magnetic: Magnetic,
    heading: Heading,
    hard_iron: HardIron,
    mag_delay: MagDelay,
    /// Hard iron subtracted from samples, body, µT.
    offset: Vec3,
    rate: Vec3,
    accel: Vec3,
    started: bool,
    pub(super) book: Bookkeeping,
}

impl AttitudeFilter {
    /// A filter that starts with its first samples: tilt from the first specific force, heading
    /// from the first field.
    #[must_use]
    pub fn new(config: AttitudeConfig) -> Self {
        Self {
            config,
            strapdown: Quat::identity(),
            level: Quat::identity(),
            force: LowPass::new(config.accel_time),
            bias: GyroBias::new(&config, Vec3::zeros(), config.initial_bias_sigma),
            stationary: StationaryDetector::new(&config),
            witness: Witness::new(),
            magnetic: Magnetic::new(None),
            heading: Heading::unknown(),
            hard_iron: HardIron::new(&config),
            mag_delay: MagDelay::default(),
            offset: Vec3::zeros(),
            rate: Vec3::zeros(),
            accel: Vec3::zeros(),
            started: false,
            book: Bookkeeping::default(),
        }
    }

    /// A filter that starts from a still calibration with heading zero; the field of the
    /// calibration becomes the reference. A calibration with values that are not finite or beyond
    /// any sensor is ignored.
    #[must_use]
    pub fn from_calibration(config: AttitudeConfig, calibration: &CalibrationResult) -> Self {
        let mut filter = Self::new(config);
        let CalibrationResult { gyro_bias, specific_force, field, complete, .. } = calibration;
        let sound = within(gyro_bias, LARGEST_BIAS) && within(specific_force, LARGEST_FORCE);
        if !sound || specific_force.norm() < 0.1 {
            return filter;
        }
        let [w, x, y, z] = attitude_from_specific_force(specific_force);
        let level = Quat::new_unchecked(w, x, y, z);
        let sigma = if *complete { config.rest_bias_sigma } else { config.initial_bias_sigma };
        filter.bias = GyroBias::new(&config, *gyro_bias, sigma);
        if *complete {
            filter.force = LowPass::settled_at(config.accel_time, (*specific_force).into());
        }
        filter.level = level;
        if within(field, LARGEST_FIELD) && field.norm() > 1.0 {
            let field = level * field;
            filter.magnetic = Magnetic::new(complete.then_some(&field));
            let sigma = if *complete { config.mag_start_sigma } else { MOVING_START_SIGMA };
            filter.heading = Heading::defined_by(&field, sigma);
        }
        filter.started = true;
        filter
    }

    /// Takes the specific force, m/s², and the rate, rad/s, both body FRD, and the time since the
    /// last step, s.
    ///
    /// Samples that are not finite or beyond any sensor, and times that are not positive, are
    /// ignored. Times above half a second count as half a second.
    pub fn step(&mut self, accel: &Vec3, gyro: &Vec3, dt: f32) {
        if dt.is_nan() || dt <= 0.0 || !within(gyro, LARGEST_RATE) || !within(accel, LARGEST_FORCE) {
            return;
        }
        let dt = dt.min(LONGEST_STEP);
        let config = &self.config;
        if !self.started {
            self.started = true;
            self.level = upwards(accel).unwrap_or_default();
        }
        self.rate = gyro - self.bias.value();
        // Two half rotations, because the force below needs the attitude at the middle of the step.
        let half = from_vector(&(self.rate * (0.5 * dt)));
        let middle = product(&self.strapdown, &half);
        self.strapdown = product(&middle, &half);
        // Rate and force are means over the step, or samples at one instant: the force belongs to
        // the middle.
        self.force.step(&(middle * accel).into(), dt);
        if let Some(correction) = upwards(&(self.level * Vec3::from(*self.force.value()))) {
            self.level = product(&correction, &self.level);
        }
        self.accel = *accel;
        let turn = Matrix3::from(self.level * self.strapdown);
        self.bias.predict(config, &turn, dt);
        let vertical = turn.row(2).transpose().into();
        self.heading.predict(self.bias.sigma_along(&vertical), self.rate.norm(), dt);
        self.stationary.step(config, accel, gyro, self.bias.calibrated(), dt);
        if self.stationary.is_quiet() {
            self.witness.is_quiet(self.stationary.is_stationary(config), &self.bias, dt);
        } else if let Some(contradiction) = self.witness.moves(&self.bias) {
            self.undo_rest(contradiction);
        }
        let config = &self.config;
        if self.stationary.is_stationary(config) {
            self.bias.update_stationary(config, &self.stationary.rate(), dt);
        // Before the low-pass has settled its derivative is zero and holds no information.
        } else if self.force.is_settled() {
            let leaning = self.level * Vec3::from(*self.force.rate());
            let norm = self.force.value().norm().max(1.0);
            self.bias.update_moving(config, [leaning.y / norm, -leaning.x / norm], dt);
        }
    }

    /// Body FRD → world NED, at the stamp of the last step. North is magnetic north, or the nose at
    /// the calibration.
    #[must_use]
    pub fn attitude(&self) -> Quat {
        product(&frame::from_yaw(self.heading.value()), &self.attitude_without_field())
    }

    /// The same without the magnetometer: same tilt, drifting heading.
    #[must_use]
    pub fn attitude_without_field(&self) -> Quat {
        let ahead = from_vector(&(self.rate * self.config.inertial_delay));
        product(&product(&self.level, &self.strapdown), &ahead)
    }

    /// Angular rate without bias, body, rad/s.
    #[must_use]
    pub fn rate(&self) -> Vec3 {
        self.rate
    }

    /// Gyro bias, body, rad/s.
    #[must_use]
    pub fn gyro_bias(&self) -> Vec3 {
        self.bias.value()
    }

    /// Standard deviation of the gyro bias, least certain axis, rad/s.
    #[must_use]
    pub fn gyro_bias_sigma(&self) -> f32 {
        self.bias.sigma()
    }

    /// Field of magnetised parts that turn with the sensor, body, µT. Zero while it is not
    /// significant.
    #[must_use]
    pub fn hard_iron(&self) -> Vec3 {
        self.offset
    }

    /// Delay of the magnetometer's samples before their stamps, s: configured plus estimated.
    #[must_use]
    pub fn mag_delay(&self) -> f32 {
        self.config.mag_delay + self.mag_delay.value(&self.config)
    }

    /// Whether the body is at rest.
    #[must_use]
    pub fn is_stationary(&self) -> bool {
        self.stationary.is_stationary(&self.config)
    }

    /// Standard deviation of the heading relative to magnetic north, rad. Above one, the heading is
    /// unknown.
    #[must_use]
    pub fn heading_sigma(&self) -> f32 {
        self.heading.sigma()
    }

    /// Difference of the last field's heading from the estimated one, rad.
    #[must_use]
    pub fn heading_innovation(&self) -> f32 {
        self.heading.innovation()
    }

    /// The last specific force, body, m/s².
    #[must_use]
    pub fn specific_force(&self) -> Vec3 {
        self.accel
    }
}
