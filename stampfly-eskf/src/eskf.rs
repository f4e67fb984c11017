//! The error-state Kalman filter as an estimator: which measurement is used when, and what happens when it disagrees.
//!
//! The arithmetic lives in [`filter`](crate::filter), the models in [`aid`](crate::aid). Use this for anything that
//! flies indoors on an inertial sensor, optical flow and a range; use the
//! [`Complementary`](crate::Complementary) filter where a few hundred bytes must do.

mod measurements;

use crate::aid::{self, Row};
use crate::config::EskfConfig;
use crate::estimator::{Estimator, Fusion, Refusal};
use crate::filter::covariance::{Covariance, ProcessNoise, Projection};
use crate::filter::state::{Motion, Rotation};
use crate::filter::{ACCEL_BIAS, ATTITUDE, GYRO_BIAS, Nominal, POSITION, RateHistory, VELOCITY};
use crate::level::attitude_from_specific_force;
use stampfly_types::messages::{
    BaroData, CalibrationResult, EstimatorCommand, EstimatorStatus, FlowData, ImuData, MagData, SensorMask,
    StateEstimate, TofData, Validity,
};
use stampfly_types::{GRAVITY, Micros, Vec3, math};

/// A sensor counts as taking part this long after its last accepted sample.
const AIDING_TIMEOUT: Micros = Micros(1_000_000);
/// Measurements older than this are refused.
const MAX_DELAY: Micros = Micros(100_000);
/// Longest inertial step that is integrated; a longer gap is a gap.
const MAX_STEP: f32 = 0.5;
/// How well the heading is known where it is defined to be zero, rad.
const HEADING_SIGMA: f32 = 1e-3;
/// Doubt beyond which a velocity and a position count as unknown, m/s and m.
const UNKNOWN_VELOCITY: f32 = 3.0;
const UNKNOWN_POSITION: f32 = 10.0;
/// While standing, the ground is absorbed at every n-th inertial sample.
const STILL_DIVIDER: u32 = 4;

/// When a sensor was last accepted, and since when it has not been.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Aid {
    fused: Option<Micros>,
    /// Since when it has been refused without a break.
    gated_since: Option<Micros>,
}

impl Aid {
    fn is_recent(&self, now: Micros) -> bool {
        self.fused.is_some_and(|at| now.since(at) < AIDING_TIMEOUT)
    }
}

/// Running mean of inertial samples between two looks at gravity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Mean {
    sum: Vec3,
    count: f32,
}

impl Mean {
    fn add(&mut self, value: &Vec3) {
        self.sum += value;
        self.count += 1.0;
    }

    fn take(&mut self) -> Option<Vec3> {
        let mean = (self.count > 0.0).then(|| self.sum / self.count);
        *self = Self::default();
        mean
    }
}

/// The error-state Kalman filter.
///
/// ```
/// use stampfly_eskf::{Eskf, EskfConfig, Estimator};
/// use stampfly_types::{Micros, Vec3, messages::{CalibrationResult, ImuData, TofData, Validity}};
///
/// let still = Vec3::new(0.0, 0.0, -9.80665);
/// let mut eskf = Eskf::new(EskfConfig::default());
/// eskf.initialize(Micros::ZERO, &CalibrationResult { specific_force: still, complete: true, ..Default::default() });
/// for k in 1..=400u64 {
///     let at = Micros(k * 2_500);
///     eskf.predict(at, &ImuData { accel: still, ..Default::default() });
///     if k % 13 == 0 {
///         eskf.fuse_tof(at, &TofData { distance: 0.5, valid: true, ..Default::default() });
///     }
/// }
/// let estimate = eskf.estimate();
/// assert!(estimate.valid.contains(Validity::HEIGHT));
/// assert!((estimate.height - 0.5).abs() < 0.01);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Eskf {
    config: EskfConfig,
    noise: ProcessNoise,
    state: Nominal,
    covariance: Covariance,
    rotation: Rotation,
    now: Micros,
    initialized: bool,
    calibration: CalibrationResult,
    command: EstimatorCommand,
    /// Where the vehicle stands, while it does.
    anchor: Option<Vec3>,
    /// World down coordinate of the surface below.
    surface: Option<f32>,
    baro_offset: Option<f32>,
    mag_reference: Option<f32>,
    steps: u32,
    imu: ImuData,
    rate: Vec3,
    force: Vec3,
    rates: RateHistory,
    accels: Mean,
    tof: Aid,
    flow: Aid,
    baro: Aid,
    mag: Aid,
    velocity: Aid,
    gravity: Aid,
    status: EstimatorStatus,
}

/// Position of each sensor in the status message's counters.
#[derive(Clone, Copy)]
enum Counter {
    Tof = 0,
    Flow = 1,
    Baro = 2,
    Mag = 3,
    Gravity = 4,
}

impl Eskf {
    /// A filter that waits to be initialised.
    #[must_use]
    pub fn new(config: EskfConfig) -> Self {
        Self {
            noise: process_noise(&config),
            covariance: initial_covariance(&config),
            config,
            state: Nominal::default(),
            rotation: Nominal::default().rotation(),
            now: Micros::ZERO,
            initialized: false,
            calibration: CalibrationResult::default(),
            command: EstimatorCommand::default(),
            anchor: None,
            surface: None,
            baro_offset: None,
            mag_reference: None,
            steps: 0,
            imu: ImuData::default(),
            rate: Vec3::zeros(),
            force: Vec3::zeros(),
            rates: RateHistory::default(),
            accels: Mean::default(),
            tof: Aid::default(),
            flow: Aid::default(),
            baro: Aid::default(),
            mag: Aid::default(),
            velocity: Aid::default(),
            gravity: Aid::default(),
            status: EstimatorStatus::default(),
        }
    }

    /// The covariance of the error state, for consistency checks and plots.
    #[must_use]
    pub fn covariance(&self) -> &Covariance {
        &self.covariance
    }

    /// The nominal state.
    #[must_use]
    pub fn nominal(&self) -> &Nominal {
        &self.state
    }

    fn correct(&mut self, projection: &Projection, innovation: f32) {
        let correction = self.covariance.absorb(projection, innovation);
        self.state.correct(&correction);
        self.rotation = self.state.rotation();
    }

    fn ratio(&self, innovation: f32, variance: f32) -> f32 {
        innovation * innovation / (self.config.gate * self.config.gate * variance)
    }

    /// One scalar measurement without a gate: for things that are known, not measured.
    fn absorb_row<const K: usize>(&mut self, row: Row<K>, measured: f32, sigma: f32) {
        let projection = self.covariance.project(row.jacobian, sigma * sigma);
        self.correct(&projection, measured - row.predicted);
    }

    /// Checks every measurement passes: initialised, finite, neither too old nor from the far future.
    fn admit(&self, at: Micros, values: &[f32]) -> Result<(), Refusal> {
        if !self.initialized {
            return Err(Refusal::NotInitialized);
        }
        if !values.iter().all(|v| v.is_finite()) {
            return Err(Refusal::NotFinite);
        }
        if self.now.since(at) > MAX_DELAY || at.since(self.now) > MAX_DELAY {
            return Err(Refusal::Stale);
        }
        Ok(())
    }

    fn count(&mut self, counter: Counter, fusion: Fusion) -> Fusion {
        if let Some(offered) = self.status.offered.get_mut(counter as usize) {
            *offered = offered.wrapping_add(1);
        }
        if matches!(fusion, Fusion::Gated { .. })
            && let Some(refused) = self.status.refused.get_mut(counter as usize)
        {
            *refused = refused.wrapping_add(1);
        }
        fusion
    }

    /// While standing: velocity and position are known, the gyro shows its bias and the accelerometer the tilt.
    fn absorb_standing(&mut self, anchor: Vec3) {
        for axis in 0..3 {
            let velocity = Row { predicted: self.state.velocity[axis], jacobian: [(VELOCITY + axis, 1.0)] };
            self.absorb_row(velocity, 0.0, self.config.still_velocity_sigma);
            let position = Row { predicted: self.state.position[axis], jacobian: [(POSITION + axis, 1.0)] };
            self.absorb_row(position, anchor[axis], self.config.still_position_sigma);
        }
    }

    fn absorb_gravity(&mut self, accel: Vec3, sigma: f32) {
        // The farther from one g, the more it is motion or vibration and the less it is tilt.
        let excess = accel.norm() - GRAVITY;
        let variance = sigma * sigma + 10.0 * excess * excess;
        let rows = aid::gravity::specific_force(&self.state, &self.rotation);
        let mut worst = 0.0f32;
        for (axis, row) in rows.iter().enumerate() {
            let projection = self.covariance.project(row.jacobian, variance);
            worst = worst.max(self.ratio(accel[axis] - row.predicted, projection.variance));
        }
        let predicted = Vec3::new(rows[0].predicted, rows[1].predicted, rows[2].predicted);
        self.status.accel_innovation = math::acos(accel.dot(&predicted) / (accel.norm() * predicted.norm()).max(1e-3));
        self.status.accel_ratio = worst;
        let fusion = if worst <= 1.0 { Fusion::Fused { ratio: worst } } else { Fusion::Gated { ratio: worst } };
        self.count(Counter::Gravity, fusion);
        if worst > 1.0 {
            let since = *self.gravity.gated_since.get_or_insert(self.now);
            if self.now.since(since).seconds() > 4.0 * self.config.lockout {
                // It never rights itself otherwise: doubt the attitude, once per lock-out, until gravity fits in again.
                self.gravity.gated_since = Some(self.now);
                for axis in 0..3 {
                    self.covariance.inflate(ATTITUDE + axis, 0.01);
                }
            }
            return;
        }
        self.gravity.gated_since = None;
        self.gravity.fused = Some(self.now);
        for axis in 0..3 {
            let row = aid::gravity::specific_force(&self.state, &self.rotation)[axis];
            let projection = self.covariance.project(row.jacobian, variance);
            self.correct(&projection, accel[axis] - row.predicted);
        }
    }

    /// Heading counts from where the vehicle was initialised, so it is known there. Doubting it would let every error of
    /// the flow sensor turn the vehicle's idea of north.
    fn know_heading(&mut self) {
        let up = self.rotation[2];
        let row = Row { predicted: 0.0, jacobian: [(ATTITUDE, up[0]), (ATTITUDE + 1, up[1]), (ATTITUDE + 2, up[2])] };
        self.absorb_row(row, 0.0, HEADING_SIGMA);
    }

    /// Without anything that measures it, a velocity is the integral of a small error of the tilt and soon larger than
    /// any that the vehicle can fly. From there on it is not estimated: it stays at zero, and the position where it is,
    /// until somebody measures it again.
    fn forget_motion(&mut self) {
        const LIMITS: [(usize, f32); 2] = [(VELOCITY, UNKNOWN_VELOCITY), (POSITION, UNKNOWN_POSITION)];
        for (block, limit) in LIMITS {
            for axis in 0..3 {
                if self.covariance.get(block + axis, block + axis) > limit * limit {
                    self.covariance.reset(block + axis, limit * limit);
                    if block == VELOCITY {
                        self.state.velocity[axis] = 0.0;
                    }
                }
            }
        }
    }

    /// Tilted out of sight of the ground, for `dt` seconds: nothing measures the velocity, and the integral of a tilt
    /// error grows by the second. Vehicles that use their velocity do not fly like this; hands carry them so, slowly.
    fn absorb_blind(&mut self, dt: f32) {
        let sigma = self.config.blind_velocity / math::sqrt(dt.max(1e-3));
        for axis in 0..3 {
            let velocity = Row { predicted: self.state.velocity[axis], jacobian: [(VELOCITY + axis, 1.0)] };
            self.absorb_row(velocity, 0.0, sigma);
        }
    }

    /// Gives up what is not finite and starts again from the last calibration.
    fn recover(&mut self) {
        let (at, calibration, resets) = (self.now, self.calibration, self.status.resets);
        self.initialize(at, &calibration);
        self.status.resets = resets.wrapping_add(1);
        self.status.diverged = true;
    }

    fn watch(&mut self) {
        if !self.state.is_finite() || (self.steps.is_multiple_of(128) && !self.covariance.is_healthy()) {
            self.recover();
        } else if self.holds_velocity() && (self.state.position.amax() > 100.0 || self.state.velocity.amax() > 50.0) {
            self.status.diverged = true;
        }
    }

    fn holds_velocity(&self) -> bool {
        self.flow.is_recent(self.now) || self.velocity.is_recent(self.now) || self.anchor.is_some()
    }

    fn gated(&mut self, aid: impl Fn(&mut Self) -> &mut Aid) -> bool {
        let now = self.now;
        let since = *aid(self).gated_since.get_or_insert(now);
        now.since(since).seconds() > self.config.lockout
    }
}

/// A flow row that says nothing about the heading. In theory flow shows it while the vehicle accelerates; in practice a
/// degree of mounting error and the beat of pictures and reads turn the vehicle's idea of north by degrees a minute,
/// where a calibrated gyro alone keeps it within one.
fn without_heading(mut row: Row<6>) -> Row<6> {
    for (state, value) in &mut row.jacobian {
        if *state == ATTITUDE + 2 {
            *value = 0.0;
        }
    }
    row
}

fn process_noise(config: &EskfConfig) -> ProcessNoise {
    let square = |v: f32| v * v;
    ProcessNoise {
        velocity: square(config.accel_noise),
        attitude: square(config.gyro_noise),
        gyro_bias: square(config.gyro_bias_walk),
        accel_bias: square(config.accel_bias_walk),
    }
}

fn initial_covariance(config: &EskfConfig) -> Covariance {
    Covariance::from_sigmas([
        config.initial_position,
        config.initial_velocity,
        config.initial_attitude,
        config.initial_gyro_bias,
        config.initial_accel_bias,
    ])
}

impl Estimator for Eskf {
    fn initialize(&mut self, at: Micros, calibration: &CalibrationResult) {
        let finite = |v: &Vec3| v.iter().all(|x| x.is_finite());
        if !finite(&calibration.gyro_bias) || !finite(&calibration.specific_force) {
            return;
        }
        let fresh = Self::new(self.config);
        *self = Self { now: at, initialized: true, calibration: *calibration, command: self.command, ..fresh };
        self.state.gyro_bias = calibration.gyro_bias;
        self.state.attitude = attitude_from_specific_force(&calibration.specific_force);
        self.rotation = self.state.rotation();
        if calibration.field.norm() > 1.0 {
            self.mag_reference = aid::heading::error(&self.rotation, &calibration.field, 0.0).map(|row| row.predicted);
        }
        self.anchor = self.command.on_ground.then(Vec3::zeros);
        self.know_heading();
    }

    fn command(&mut self, at: Micros, command: &EstimatorCommand) {
        let previous = core::mem::replace(&mut self.command, *command);
        if command.full_resets != previous.full_resets && self.initialized {
            let calibration = self.calibration;
            self.initialize(at, &calibration);
        }
        if command.origin_resets != previous.origin_resets {
            self.surface = self.surface.map(|surface| surface - self.state.position.z);
            self.baro_offset = self.baro_offset.map(|offset| offset - self.state.position.z);
            self.state.position = Vec3::zeros();
            self.state.velocity = Vec3::zeros();
            for axis in 0..3 {
                self.covariance.reset(POSITION + axis, self.config.initial_position * self.config.initial_position);
                self.covariance.reset(VELOCITY + axis, self.config.initial_velocity * self.config.initial_velocity);
            }
            self.anchor = None;
        }
        match (command.on_ground, self.anchor) {
            (true, None) => self.anchor = Some(self.state.position),
            (false, Some(anchor)) => {
                // Blind on the ground: the surface is one clearance below.
                self.surface.get_or_insert(anchor.z + self.config.ground_clearance);
                self.anchor = None;
                let vibration = self.config.vibration_bias;
                self.covariance.inflate(ACCEL_BIAS + 2, vibration * vibration);
            }
            _ => {}
        }
    }

    fn predict(&mut self, at: Micros, imu: &ImuData) {
        let usable = imu.accel.iter().chain(imu.gyro.iter()).all(|v| v.is_finite());
        let dt = at.since(self.now).seconds();
        if !self.initialized || !usable || dt <= 0.0 {
            return;
        }
        self.now = at;
        self.imu = *imu;
        let motion: Motion = self.state.propagate(&imu.accel, &imu.gyro, dt.min(MAX_STEP));
        self.covariance.propagate(&motion, &self.noise);
        self.rotation = self.state.rotation();
        self.rate = motion.rate;
        self.force = motion.force;
        self.rates.add(at, motion.dt, imu.gyro);
        self.accels.add(&imu.accel);
        self.steps = self.steps.wrapping_add(1);
        if self.steps.is_multiple_of(STILL_DIVIDER)
            && let Some(accel) = self.accels.take()
        {
            if let Some(anchor) = self.anchor {
                self.absorb_standing(anchor);
                self.absorb_gravity(accel, self.config.still_gravity_sigma);
            } else if !self.holds_velocity() {
                self.absorb_gravity(accel, self.config.gravity_sigma);
                self.forget_motion();
            } else if self.rotation[2][2] < self.config.min_cos_tilt && !self.velocity.is_recent(at) {
                self.absorb_blind(dt * STILL_DIVIDER as f32);
            }
        }
        self.watch();
    }

    fn fuse_tof(&mut self, at: Micros, tof: &TofData) -> Fusion {
        let fusion = self.try_tof(at, tof).unwrap_or_else(Fusion::Refused);
        self.count(Counter::Tof, fusion)
    }

    fn fuse_flow(&mut self, at: Micros, flow: &FlowData) -> Fusion {
        let fusion = self.try_flow(at, flow).unwrap_or_else(Fusion::Refused);
        self.count(Counter::Flow, fusion)
    }

    fn fuse_baro(&mut self, at: Micros, baro: &BaroData) -> Fusion {
        let fusion = self.try_baro(at, baro).unwrap_or_else(Fusion::Refused);
        self.count(Counter::Baro, fusion)
    }

    fn fuse_mag(&mut self, at: Micros, mag: &MagData) -> Fusion {
        let fusion = self.try_mag(at, mag).unwrap_or_else(Fusion::Refused);
        self.count(Counter::Mag, fusion)
    }

    fn fuse_velocity(&mut self, at: Micros, velocity: &Vec3, sigma: f32) -> Fusion {
        self.try_velocity(at, velocity, sigma).unwrap_or_else(Fusion::Refused)
    }

    fn estimate(&self) -> StateEstimate {
        let now = self.now;
        let standing = self.anchor.is_some();
        let sound = self.initialized && !self.status.diverged;
        let horizontal = sound && self.holds_velocity();
        let vertical =
            sound && (self.tof.is_recent(now) || self.baro.is_recent(now) || self.velocity.is_recent(now) || standing);
        let valid = Validity::NONE
            .set(Validity::TILT, self.initialized)
            .set(Validity::HEADING, self.initialized)
            .set(Validity::VELOCITY_XY | Validity::POSITION_XY, horizontal)
            .set(Validity::VELOCITY_Z | Validity::POSITION_Z, vertical)
            .set(Validity::HEIGHT, sound && self.surface.is_some() && vertical);
        let sensors = SensorMask::NONE
            .set(SensorMask::IMU, self.initialized)
            .set(SensorMask::TOF, self.tof.is_recent(now))
            .set(SensorMask::FLOW, self.flow.is_recent(now))
            .set(SensorMask::BARO, self.baro.is_recent(now))
            .set(SensorMask::MAG, self.mag.is_recent(now))
            .set(SensorMask::ACCEL_ATTITUDE, self.gravity.is_recent(now))
            .set(SensorMask::STATIONARY, standing)
            .set(SensorMask::EXTERNAL, self.velocity.is_recent(now));
        let p = &self.covariance;
        StateEstimate {
            attitude: self.state.quat(),
            position: self.state.position,
            velocity: self.state.velocity,
            angular_rate: self.rate,
            specific_force: self.force,
            gyro_bias: self.state.gyro_bias,
            accel_bias: self.state.accel_bias,
            height: self.surface.unwrap_or(self.config.ground_clearance) - self.state.position.z,
            position_std_xy: math::sqrt(p.get(POSITION, POSITION) + p.get(POSITION + 1, POSITION + 1)),
            valid,
            sensors,
        }
    }

    fn status(&self) -> EstimatorStatus {
        self.status
    }
}
