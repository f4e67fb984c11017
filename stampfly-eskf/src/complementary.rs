//! A complementary filter: gyro at high frequencies, gravity, range and flow at low ones.
//!
//! Use it where a few hundred bytes and some fifty nanoseconds per step must do, or as a second
//! implementation of [`Estimator`]. It has fixed gains, no covariance, no gates except fixed
//! limits, and does not estimate the accelerometer bias. In aggressive flight its tilt is some
//! degrees worse than that of [`Eskf`](crate::Eskf).
//!
//! Attitude: Mahony, Hamel, Pflimlin, "Nonlinear complementary filters on the special orthogonal
//! group", IEEE TAC 53(5), 2008, corrected by gravity only while the velocity is not measured.
//! Height and velocity: fixed-gain observers. Units are SI, the world frame is NED.

use crate::estimator::{Estimator, Fusion, Refusal};
use crate::filter::NominalState;
use crate::filter::state::{rotate, rotate_back};
use crate::level::attitude_from_specific_force;
use stampfly_types::messages::{
    BaroData, CalibrationResult, EstimatorCommand, EstimatorStatus, FlowData, ImuData, MagData, SensorMask,
    StateEstimate, TofData, Validity,
};
use stampfly_types::{Duration, GRAVITY, Instant, Vec3};

/// Gains of the [`Complementary`] filter.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ComplementaryConfig {
    /// Gain of the attitude correction by gravity, 1/s.
    pub gravity_gain: f32,
    /// Gain of the gyro bias correction by gravity, 1/s².
    pub bias_gain: f32,
    /// Share of a range's innovation added to the height.
    pub tof_position_gain: f32,
    /// Gain from a range's innovation to the climb rate, 1/s.
    pub tof_velocity_gain: f32,
    /// Share of a flow sample's innovation added to the velocity.
    pub flow_gain: f32,
    /// Gain from a flow sample's innovation to the tilt, rad per m/s.
    pub flow_tilt_gain: f32,
    /// Distance from the range sensor to the ground while standing, m.
    pub ground_clearance: f32,
}

impl Default for ComplementaryConfig {
    fn default() -> Self {
        Self {
            gravity_gain: 0.4,
            bias_gain: 0.02,
            tof_position_gain: 0.3,
            tof_velocity_gain: 1.0,
            flow_gain: 0.04,
            flow_tilt_gain: 0.002,
            ground_clearance: 0.03,
        }
    }
}

/// The complementary filter: fixed gains, no covariance. See [`Estimator`] for how to call it.
///
/// ```
/// use stampfly_eskf::{Complementary, ComplementaryConfig, Estimator};
/// use stampfly_types::{Instant, Vec3, messages::{CalibrationResult, ImuData}};
///
/// let still = Vec3::new(0.0, 0.0, -9.80665);
/// let mut filter = Complementary::new(ComplementaryConfig::default());
/// filter.initialize(Instant::ZERO, &CalibrationResult { specific_force: still, ..Default::default() });
/// filter.predict(Instant::from_micros(2_500), &ImuData { accel: still, ..Default::default() });
/// assert!(filter.estimate().attitude.angle() < 1e-6);
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Complementary {
    config: ComplementaryConfig,
    state: NominalState,
    now: Instant,
    initialized: bool,
    calibration: CalibrationResult,
    command: EstimatorCommand,
    anchor: Option<Vec3>,
    surface: Option<f32>,
    rate: Vec3,
    force: Vec3,
    tof_fused: Option<Instant>,
    flow_fused: Option<Instant>,
    status: EstimatorStatus,
}

impl Complementary {
    /// A filter that is not yet initialised.
    #[must_use]
    pub fn new(config: ComplementaryConfig) -> Self {
        Self {
            config,
            state: NominalState::default(),
            now: Instant::ZERO,
            initialized: false,
            calibration: CalibrationResult::default(),
            command: EstimatorCommand::default(),
            anchor: None,
            surface: None,
            rate: Vec3::zeros(),
            force: Vec3::zeros(),
            tof_fused: None,
            flow_fused: None,
            status: EstimatorStatus::default(),
        }
    }

    fn recent(&self, fused: Option<Instant>) -> bool {
        fused.is_some_and(|at| self.now.since(at) < Duration::from_secs(1))
    }

    fn turn(&mut self, by: Vec3) {
        let mut correction = [0.0; crate::filter::N];
        correction[crate::filter::ATTITUDE..crate::filter::GYRO_BIAS].copy_from_slice(&by.to_array());
        self.state.correct(&correction);
    }
}

impl Estimator for Complementary {
    fn initialize(&mut self, at: Instant, calibration: &CalibrationResult) {
        if !calibration.gyro_bias.iter().chain(calibration.specific_force.iter()).all(|v| v.is_finite()) {
            return;
        }
        *self = Self {
            now: at,
            initialized: true,
            calibration: *calibration,
            command: self.command,
            anchor: self.command.on_ground.then(Vec3::zeros),
            ..Self::new(self.config)
        };
        self.state.gyro_bias = calibration.gyro_bias;
        self.state.attitude = attitude_from_specific_force(&calibration.specific_force);
    }

    fn command(&mut self, at: Instant, command: &EstimatorCommand) {
        let previous = core::mem::replace(&mut self.command, *command);
        if command.full_resets != previous.full_resets && self.initialized {
            let calibration = self.calibration;
            self.initialize(at, &calibration);
        }
        if command.origin_resets != previous.origin_resets {
            self.surface = self.surface.map(|surface| surface - self.state.position.z);
            self.state.position = Vec3::zeros();
            self.state.velocity = Vec3::zeros();
            self.anchor = None;
        }
        match (command.on_ground, self.anchor) {
            (true, None) => self.anchor = Some(self.state.position),
            (false, Some(anchor)) => {
                self.surface.get_or_insert(anchor.z + self.config.ground_clearance);
                self.anchor = None;
            }
            _ => {}
        }
    }

    fn predict(&mut self, at: Instant, imu: &ImuData) {
        let usable = imu.accel.iter().chain(imu.gyro.iter()).all(|v| v.is_finite());
        let dt = at.since(self.now).seconds();
        if !self.initialized || !usable || dt <= 0.0 {
            return;
        }
        self.now = at;
        // Bounds the step over a gap in the samples.
        let dt = dt.min(0.5);
        // Without the accelerometer, assume that thrust carries the weight along body z. That
        // assumption holds no information about tilt.
        let felt = !self.command.accel_faulty;
        let accel = if felt { imu.accel } else { Vec3::new(0.0, 0.0, -GRAVITY) };
        let motion = self.state.propagate(&accel, &imu.gyro, dt);
        (self.rate, self.force) = (motion.rate, motion.force);
        let stationary = self.anchor.is_some();
        if let Some(anchor) = self.anchor {
            self.state.position = anchor;
            self.state.velocity = Vec3::zeros();
        }
        // With a measured velocity, flow corrects the tilt; gravity would be wrong by the body's
        // acceleration.
        if felt && (stationary || !self.recent(self.flow_fused)) {
            let norm = imu.accel.norm();
            // Beyond 20 % the body accelerates, and the specific force does not point up.
            if (0.8 * GRAVITY..1.2 * GRAVITY).contains(&norm) {
                let up = rotate_back(&self.state.rotation(), &-Vec3::z());
                let error = (imu.accel / norm).cross(&up);
                self.turn(error * (self.config.gravity_gain * dt));
                self.state.gyro_bias -= error * (self.config.bias_gain * dt);
                self.status.accel_innovation = error.norm();
            }
        }
        if !self.state.is_finite() {
            let calibration = self.calibration;
            self.initialize(at, &calibration);
            self.status.diverged = true;
        }
        self.status.diverged |= self.state.position.amax() > 100.0 || self.state.velocity.amax() > 50.0;
    }

    fn fuse_tof(&mut self, _: Instant, tof: &TofData) -> Fusion {
        let cos_tilt = self.state.rotation()[2][2];
        if !self.initialized {
            return Fusion::Refused(Refusal::NotInitialized);
        }
        if !tof.valid || !(0.02..=4.0).contains(&tof.distance) {
            return Fusion::Refused(Refusal::Range);
        }
        if cos_tilt < 0.87 {
            return Fusion::Refused(Refusal::Tilt);
        }
        let below = tof.distance * cos_tilt;
        let surface = *self.surface.get_or_insert(self.state.position.z + below);
        if let Some(anchor) = self.anchor {
            // On the ground the height is known and the range measures the surface; in flight it is
            // the reverse.
            self.surface = Some(surface + 0.1 * (anchor.z + below - surface));
        } else {
            let error = (surface - below) - self.state.position.z;
            self.status.tof_innovation = -error;
            self.state.position.z += self.config.tof_position_gain * error;
            self.state.velocity.z += self.config.tof_velocity_gain * error;
        }
        self.tof_fused = Some(self.now);
        Fusion::Fused { ratio: 0.0 }
    }

    fn fuse_flow(&mut self, _: Instant, flow: &FlowData) -> Fusion {
        if !self.initialized {
            return Fusion::Refused(Refusal::NotInitialized);
        }
        let finite = flow.delta_x.is_finite() && flow.delta_y.is_finite();
        if !flow.valid || !finite || flow.quality < 25 || !(1e-3..=0.1).contains(&flow.interval) {
            return Fusion::Refused(Refusal::Quality);
        }
        let Some(surface) = self.surface else { return Fusion::Refused(Refusal::Missing) };
        let rotation = self.state.rotation();
        // The lower bound keeps the division finite beyond 60° of tilt.
        let distance = (surface - self.state.position.z) / rotation[2][2].max(0.5);
        let rate = [flow.delta_x / flow.interval, flow.delta_y / flow.interval];
        let measured = crate::aid::flow::measured_velocity(rate, [self.rate.x, self.rate.y], distance);
        let body = rotate_back(&rotation, &self.state.velocity);
        let error = Vec3::new(measured[0] - body.x, measured[1] - body.y, 0.0);
        self.status.flow_innovation = [error.x, error.y];
        if self.anchor.is_none() {
            self.state.velocity += rotate(&rotation, &error) * self.config.flow_gain;
            // A velocity forward that is larger than predicted means that the nose is lower than
            // estimated.
            self.turn(Vec3::new(error.y, -error.x, 0.0) * self.config.flow_tilt_gain);
        }
        self.flow_fused = Some(self.now);
        Fusion::Fused { ratio: 0.0 }
    }

    fn fuse_baro(&mut self, _: Instant, _: &BaroData) -> Fusion {
        Fusion::Refused(Refusal::NotUsed)
    }

    fn fuse_mag(&mut self, _: Instant, _: &MagData) -> Fusion {
        Fusion::Refused(Refusal::NotUsed)
    }

    fn fuse_velocity(&mut self, _: Instant, velocity: &Vec3, sigma: &Vec3) -> Fusion {
        for axis in 0..3 {
            // An axis with an infinite standard deviation was not measured and stays unchanged.
            let error = if sigma[axis].is_infinite() { 0.0 } else { velocity[axis] - self.state.velocity[axis] };
            if !error.is_finite() {
                return Fusion::Refused(Refusal::NotFinite);
            }
        }
        for axis in 0..3 {
            if !sigma[axis].is_infinite() {
                self.state.velocity[axis] += (velocity[axis] - self.state.velocity[axis]) * 0.1;
            }
        }
        self.flow_fused = Some(self.now);
        Fusion::Fused { ratio: 0.0 }
    }

    fn estimate(&self) -> StateEstimate {
        let stationary = self.anchor.is_some();
        let sound = self.initialized && !self.status.diverged;
        let horizontal = sound && (stationary || self.recent(self.flow_fused));
        let vertical = sound && (stationary || self.recent(self.tof_fused));
        StateEstimate {
            attitude: self.state.quat(),
            position: self.state.position,
            velocity: self.state.velocity,
            angular_rate: self.rate,
            specific_force: self.force,
            gyro_bias: self.state.gyro_bias,
            accel_bias: self.state.accel_bias,
            height: self.surface.unwrap_or(self.config.ground_clearance) - self.state.position.z,
            position_std_xy: 0.0,
            valid: Validity::NONE
                .set(Validity::TILT | Validity::HEADING, self.initialized)
                .set(Validity::VELOCITY_XY | Validity::POSITION_XY, horizontal)
                .set(Validity::VELOCITY_Z | Validity::POSITION_Z, vertical)
                .set(Validity::HEIGHT, vertical && self.surface.is_some()),
            sensors: SensorMask::NONE
                .set(SensorMask::IMU, self.initialized)
                .set(SensorMask::TOF, self.recent(self.tof_fused))
                .set(SensorMask::FLOW, self.recent(self.flow_fused))
                .set(SensorMask::STATIONARY, stationary),
        }
    }

    fn status(&self) -> EstimatorStatus {
        self.status
    }
}
