//! The error-state Kalman filter as an estimator: which measurement is used when, and what happens when it disagrees.
//!
//! The arithmetic lives in [`filter`](crate::filter), the models in [`aid`](crate::aid). Use this for anything that
//! flies indoors on an inertial sensor, optical flow and a range; use the
//! [`Complementary`](crate::Complementary) filter where a few hundred bytes must do.
//!
//! | file | what |
//! |---|---|
//! | `eskf.rs` | the filter itself and its time |
//! | `eskf/interface.rs` | the [`Estimator`] it is |
//! | `eskf/measurements.rs` | one function a sensor |
//! | `eskf/assumptions.rs` | what is assumed where nothing measures |
//! | `eskf/gate.rs` | gates, lock-outs, resets |
//! | `eskf/persistence.rs` | innovations that keep to one side |

mod assumptions;
mod gate;
mod interface;
mod measurements;
mod persistence;

use crate::aid::baro::Offset;
use crate::aid::gravity::Acceleration;
use crate::aid::{self, Row};
use crate::config::{EskfConfig, GravityUse};
use crate::estimator::{Estimator, Fusion, Refusal};
use crate::filter::covariance::{Covariance, ProcessNoise, Projection};
use crate::filter::history::REACH;
use crate::filter::state::{Rotation, multiply, rotate, rotate_back};
use crate::filter::{ACCEL_BIAS, ATTITUDE, GYRO_BIAS, History, Nominal, POSITION, Passage, Roughness, VELOCITY};
use crate::level::attitude_from_specific_force;
use gate::{Gates, Sensor};
use persistence::Persistence;
use stampfly_types::messages::{
    BaroData, CalibrationResult, EstimatorCommand, EstimatorStatus, FlowData, ImuData, MagData, SensorMask,
    StateEstimate, TofData, Validity,
};
use stampfly_types::{Duration, GRAVITY, Instant, Quat, Vec3, math};

/// Measurements from farther ahead than this are refused, s.
const AHEAD: f32 = 0.02;
/// Measurements this close to the last inertial sample are compared with the present state, s.
const PRESENT: f32 = 0.5e-3;
/// Longest inertial step that is integrated; a longer gap is a gap.
const MAX_STEP: f32 = 0.5;
/// The state moves with every inertial sample, its doubt with the first sample after this much time, s: at 400 Hz with
/// every second one. A hundredth of the time in which doubt changes, and half the work. (PX4's EKF2 takes 10 ms.)
const DOUBT_STEP: f32 = 4e-3;
/// What is added to the doubt of a filter whose innovations keep to one side, rad and rad/s.
const DOUBTED_TILT: f32 = 0.1;
const DOUBTED_GYRO_BIAS: f32 = 0.03;
/// What is assumed where nothing measures is looked at on every n-th inertial sample.
const STILL_DIVIDER: u32 = 4;

/// Running mean of inertial samples between two looks at gravity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
/// use stampfly_types::{Instant, Vec3, messages::{CalibrationResult, ImuData, TofData, Validity}};
///
/// let still = Vec3::new(0.0, 0.0, -9.80665);
/// let mut eskf = Eskf::new(EskfConfig::default());
/// eskf.initialize(Instant::ZERO, &CalibrationResult { specific_force: still, complete: true, ..Default::default() });
/// for k in 1..=400u64 {
///     let at = Instant::from_micros(k * 2_500);
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
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Eskf {
    config: EskfConfig,
    noise: ProcessNoise,
    state: Nominal,
    covariance: Covariance,
    /// What the covariance has yet to follow, and the attitude in which that began.
    pending: Passage,
    start: Rotation,
    history: History,
    /// Of the specific force and of the rate.
    roughness: [Roughness; 2],
    now: Instant,
    initialized: bool,
    calibration: CalibrationResult,
    command: EstimatorCommand,
    /// Where the vehicle stands, while it does.
    anchor: Option<Vec3>,
    /// World down coordinate of the surface below.
    surface: Option<f32>,
    baro_offset: Option<Offset>,
    baro_seen: Instant,
    /// Direction of the magnetic field, world.
    field: Option<Vec3>,
    acceleration: Acceleration,
    steps: u32,
    rate: Vec3,
    force: Vec3,
    accels: Mean,
    gates: Gates,
    persistence: Persistence,
    /// Last specific force used as the vertical, and what it should have been.
    gravity: [Vec3; 2],
    status: EstimatorStatus,
}

/// The state at the time of a measurement.
struct Then {
    state: Nominal,
    rotation: Rotation,
    /// What happened since.
    passage: Passage,
    /// How long ago that is, s; zero for the present.
    age: f32,
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
            pending: Passage::default(),
            start: Nominal::default().rotation(),
            history: History::default(),
            roughness: [Roughness::default(); 2],
            now: Instant::ZERO,
            initialized: false,
            calibration: CalibrationResult::default(),
            command: EstimatorCommand::default(),
            anchor: None,
            surface: None,
            baro_offset: None,
            baro_seen: Instant::ZERO,
            field: None,
            acceleration: Acceleration::default(),
            steps: 0,
            rate: Vec3::zeros(),
            force: Vec3::zeros(),
            accels: Mean::default(),
            gates: Gates::default(),
            persistence: Persistence::default(),
            gravity: [Vec3::zeros(); 2],
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

    /// The state now, as something to compare a measurement with.
    fn present(&self) -> Then {
        Then { state: self.state, rotation: self.state.rotation(), passage: Passage::default(), age: 0.0 }
    }

    /// Checks every measurement passes: initialised, finite, new, neither too old nor from the future. Gives the state
    /// it is to be compared with.
    fn admit(&mut self, sensor: Sensor, at: Instant, values: &[f32]) -> Result<Then, Refusal> {
        if !self.initialized {
            return Err(Refusal::NotInitialized);
        }
        if !values.iter().all(|v| v.is_finite()) {
            return Err(Refusal::NotFinite);
        }
        let age = self.now.signed_seconds_since(at);
        if age > REACH {
            return Err(Refusal::Stale);
        }
        if age < -AHEAD {
            return Err(Refusal::Future);
        }
        if !self.gates.is_new(sensor, at) {
            return Err(Refusal::Repeated);
        }
        if age.abs() < PRESENT {
            return Ok(self.present());
        }
        // Right after the start there is no past to compare with.
        let passage = self.history.since(age).ok_or(Refusal::Stale)?;
        let state = passage.before(&self.state);
        Ok(Then { state, rotation: state.rotation(), passage, age })
    }

    /// Compares a measurement with the state of its time: what it would do.
    #[inline]
    fn compare<const M: usize>(
        &self,
        then: &Then,
        rows: [Row; M],
        measured: [f32; M],
        variances: [f32; M],
    ) -> Projection<M> {
        let carried = |row: &Row| {
            if then.age == 0.0 { row.jacobian } else { then.passage.carry(&then.rotation, &row.jacobian) }
        };
        let jacobians = rows.each_ref().map(carried);
        let mut innovations = measured;
        for (innovation, row) in innovations.iter_mut().zip(&rows) {
            *innovation -= row.predicted;
        }
        self.covariance.project(&jacobians, innovations, variances)
    }

    /// The test ratio of a measurement: beyond one it is outside the gate.
    #[inline]
    fn ratio<const M: usize>(&self, projection: &Projection<M>) -> f32 {
        projection.distance() / self.config.gate_distance(M)
    }

    /// Lets a measurement into the estimate.
    #[inline]
    fn absorb<const M: usize>(&mut self, projection: &Projection<M>, ratio: f32) -> Fusion {
        let correction = self.covariance.absorb(projection);
        self.state.correct(&correction);
        Fusion::Fused { ratio }
    }

    /// Absorbs what is known, not measured: no gate.
    fn know<const M: usize>(&mut self, rows: [Row; M], values: [f32; M], sigma: f32) {
        let projection = self.compare(&self.present(), rows, values, [sigma * sigma; M]);
        let ratio = self.ratio(&projection);
        self.absorb(&projection, ratio);
    }

    /// Starts the memory anew: after a turn of the state the kept impulses point elsewhere, after a gap their time is
    /// wrong. Late measurements wait until there is a past again.
    fn forget_past(&mut self) {
        self.history = History::default();
        self.pending = Passage::default();
        self.start = self.state.rotation();
    }

    /// Notes that the state was moved to a sensor that had been locked out.
    fn moved_to(&mut self, sensor: Sensor) -> Fusion {
        self.status.resets = self.status.resets.wrapping_add(1);
        self.status.diverged |= self.gates.reset(sensor, self.now);
        Fusion::Reset
    }

    /// Doubts what flow shows only by and by, because its innovations keep to one side. Doubting it again and again means
    /// that the estimate is lost.
    fn doubt(&mut self) {
        self.doubt_tilt();
        self.status.diverged |= self.gates.doubt(self.now);
    }

    /// Doubts the tilt and what may have tilted it.
    fn doubt_tilt(&mut self) {
        for axis in 0..2 {
            self.covariance.inflate(ATTITUDE + axis, DOUBTED_TILT * DOUBTED_TILT);
            self.covariance.inflate(GYRO_BIAS + axis, DOUBTED_GYRO_BIAS * DOUBTED_GYRO_BIAS);
            // Tilt and accelerometer bias look alike to flow: what went into the bias is asked for again.
            self.forget_accel_bias(axis);
        }
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
        let by = [Sensor::Flow, Sensor::Velocity, Sensor::Position];
        self.anchor.is_some() || by.into_iter().any(|sensor| self.gates.is_recent(sensor, self.now))
    }

    /// What gravity says where it is asked, and what is assumed where nobody can be.
    fn assume(&mut self, accel: Vec3, dt: f32) {
        if self.anchor.is_some() {
            self.absorb_gravity(accel, &Vec3::zeros(), self.config.still_gravity_sigma);
        } else if !self.holds_velocity() {
            if self.config.gravity_use == GravityUse::WhenUnaided {
                self.absorb_gravity(accel, &Vec3::zeros(), self.config.gravity_sigma);
            }
            self.forget_motion();
        } else if self.state.cos_tilt() < self.config.min_cos_tilt
            && !self.gates.is_recent(Sensor::Velocity, self.now)
            && !self.gates.is_recent(Sensor::Position, self.now)
        {
            self.absorb_blind(dt);
        }
    }
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
