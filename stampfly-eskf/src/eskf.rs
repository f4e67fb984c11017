//! Error-state Kalman filter ([`Eskf`]): prediction, gated updates, inflation and resets.
//!
//! Use it for a vehicle with an inertial sensor and aiding sensors. Where a few hundred bytes must
//! do, use [`Complementary`](crate::Complementary). The arithmetic is in [`filter`](crate::filter).
//! The measurement models, each with the conditions for start, continuation, stop and reset, are in
//! [`aid`](crate::aid).
//!
//! Order of an update: refuse unusable samples, compute the state at the time of the sample,
//! predict, compute the innovation, test it against the gate, then fuse, reject, or reset after a
//! lock-out.
//!
//! | file | content |
//! |---|---|
//! | `eskf.rs` | state of the filter, time alignment, update |
//! | `eskf/interface.rs` | [`Estimator`]: initialise, command, predict, estimate |
//! | `eskf/bridge.rs` | corrupt inertial samples |
//! | `eskf/unfelt.rs` | operation without accelerometer |
//! | `eskf/measurements.rs` | updates with on-board sensors |
//! | `eskf/external.rs` | external position, velocity, attitude; measurements with a user's model |
//! | `eskf/airspeed.rs` | airspeed and wind |
//! | `eskf/alignment.rs` | heading from the changes of a measured velocity |
//! | `eskf/wander.rs` | constant part of a receiver's error |
//! | `eskf/pseudo_measurements.rs` | stationary, gravity, drag, initial heading, unobserved velocity |
//! | `eskf/resets.rs` | inflation, resets, restarts, health check |
//! | `eskf/gate.rs` | innovation gates, lock-outs, reset counter |
//! | `eskf/range_gate.rs` | plausibility of ranges |
//! | `eskf/fast_turn.rs` | rotation too fast for optical flow |
//! | `eskf/innovation_bias.rs` | test of the flow innovations for a non-zero mean |

mod airspeed;
mod alignment;
mod bridge;
mod external;
mod fast_turn;
mod gate;
mod innovation_bias;
mod interface;
mod measurements;
mod pseudo_measurements;
mod range_gate;
mod resets;
mod unfelt;
mod wander;

use crate::aid::baro::Offset;
use crate::aid::gravity::Acceleration;
use crate::aid::{self, Row};
use crate::config::{EskfConfig, GravityUse, StartHeading};
use crate::estimator::{Estimator, Fusion, Refusal};
use crate::filter::covariance::{Covariance, Innovation, ProcessNoise};
use crate::filter::state::{Rotation, multiply, rotate, rotate_back, rotation_matrix};
use crate::filter::{
    ACCEL_BIAS, ATTITUDE, GYRO_BIAS, History, N, NominalState, POSITION, PropagationStep, VELOCITY, Vibration,
};
use crate::level::attitude_from_specific_force;
use crate::measurements::Aiding;
use crate::tally::{Tallies, Tally};
use alignment::Alignment;
use bridge::Bridge;
use fast_turn::FastTurn;
use gate::{GateResult, Gates, Sensor};
use innovation_bias::InnovationBiasMonitor;
use range_gate::RangeGate;
use stampfly_types::messages::{
    BaroData, CalibrationResult, EstimateCorrection, EstimatorCommand, EstimatorStatus, FlowData, ImuData, MagData,
    SensorFindings, SensorMask, StateEstimate, TofData, Validity,
};
use stampfly_types::{Duration, GRAVITY, Instant, Quat, Vec3, math};
use wander::Wander;

/// Largest time by which a measurement may be ahead of the last inertial sample, s.
const MAX_AHEAD: f32 = 0.02;
/// Measurements closer in time to the last inertial sample than this are compared with the present
/// state, s.
const SIMULTANEOUS: f32 = 0.5e-3;
/// Longest inertial step that is integrated, s. A longer one is a gap: the step is shortened and
/// the history cleared.
const MAX_STEP: f32 = 0.5;
/// Interval between two propagations of the covariance, s. The state is propagated with every
/// inertial sample, the covariance with the first one after this time: at 400 Hz with every fourth,
/// for a quarter of the work. The covariance changes within tenths of a second. (EKF2 uses 10 ms,
/// `EKF2_PREDICT_US`.)
const COVARIANCE_STEP: f32 = 9e-3;
/// Largest standard deviation of a velocity that is still marked valid when it comes from drag
/// alone, m/s. At 0.4 1/s a velocity of 1 m/s is 0.4 m/s², as much as an accelerometer bias or a
/// wind of 1 m/s.
const BRAKES: f32 = 1.5;
/// Below this height, m, velocity from drag is not used: the ground may carry the vehicle.
const LEVEL: f32 = 0.12;
/// Duration of a take-off, in which the velocity stays valid without flow: at 0.03 m/s the vehicle
/// has then reached a height at which the camera works.
const RISES: Duration = Duration::from_secs(3);
/// Pseudo-measurements are fused with every n-th inertial sample.
const PSEUDO_MEASUREMENT_DIVIDER: u32 = 4;

/// Mean of the inertial samples between two gravity updates.
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

    /// The mean and the number of samples, and starts again. `None` without samples.
    fn take(&mut self) -> Option<(Vec3, f32)> {
        let Self { sum, count } = core::mem::take(self);
        (count > 0.0).then(|| (sum / count, count))
    }
}

/// Fifteen-state error-state Kalman filter.
///
/// Position and velocity are in world NED, m and m/s; attitude is body → world. 6.5 kB, a third of
/// it the history for late measurements. See [`Estimator`] for the call order.
///
/// # Timing
/// A `predict` that propagates the covariance, every fourth one at 400 Hz, costs more than the
/// others. To bound the cost of a step with many new samples use [`Pacer`](crate::Pacer).
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
///         _ = eskf.fuse_tof(at, &TofData { distance: 0.5, valid: true, ..Default::default() });
///     }
/// }
/// let estimate = eskf.estimate();
/// assert!(estimate.valid.contains(Validity::HEIGHT));
/// assert!((estimate.height - 0.5).abs() < 0.01);
/// ```
// Memory order, fixed by `repr(C)`: first the covariance, which every update reads, then the fields
// used by each sample, then those passed on as a whole. A load instruction of a Cortex-M4F reaches
// 1020 bytes; the order saves 3 % of the instructions of the flight chain there.
#[repr(C)]
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Eskf {
    covariance: Covariance,
    now: Instant,
    baro_updated: Instant,
    /// `config.aiding_timeout` as a `Duration`, converted once because it is compared several times
    /// per inertial sample.
    aiding_timeout: Duration,
    config: EskfConfig,
    noise: ProcessNoise,
    state: NominalState,
    command: EstimatorCommand,
    /// Position of the stationary vehicle; `None` in flight.
    anchor: Option<Vec3>,
    /// World down coordinate of the surface below, m; `None` until it is known.
    surface: Option<f32>,
    baro_offset: Option<Offset>,
    /// Direction of the magnetic field, world, unit length.
    field: Option<Vec3>,
    initialized: bool,
    steps: u32,
    rate: Vec3,
    force: Vec3,
    gates: Gates,
    status: EstimatorStatus,
    /// Inertial samples over which the covariance has not been propagated yet, and the attitude at
    /// their start.
    pending_step: PropagationStep,
    pending_rotation: Rotation,
    acceleration: Acceleration,
    accels: Mean,
    /// Mean of the samples since the last covariance step, for [`GravityUse::Always`].
    felt: Mean,
    /// Of specific force and angular rate.
    vibration: [Vibration; 2],
    alignment: Alignment,
    flow_innovation_bias: InnovationBiasMonitor,
    bridge: Bridge,
    range_gate: RangeGate,
    /// Time at which a range was last compared with the estimate.
    range_used: Instant,
    /// The distance to the floor has once reached `flow_min_distance` in this flight.
    has_seen_floor: bool,
    /// Time at which the vehicle last left the ground.
    stood: Option<Instant>,
    fast_turn: FastTurn,
    findings: SensorFindings,
    history: History,
    calibration: CalibrationResult,
    tallies: Tallies,
    wander: Wander,
}

/// State at the time of a measurement: EKF2's delayed time horizon, computed back for each
/// measurement.
struct DelayedState {
    state: NominalState,
    rotation: Rotation,
    /// Propagation from the measurement to the present.
    step: PropagationStep,
    /// Age of the measurement, s. Zero for the present.
    age: f32,
}

/// Index of each sensor in the counters of the status message.
#[derive(Clone, Copy)]
enum Counter {
    Tof = 0,
    Flow = 1,
    Baro = 2,
    Mag = 3,
    Gravity = 4,
}

impl Eskf {
    /// A filter that is not yet initialised.
    #[inline(always)]
    #[must_use]
    pub fn new(config: EskfConfig) -> Self {
        Self {
            noise: process_noise(&config),
            covariance: initial_covariance(&config),
            config,
            state: NominalState::default(),
            pending_step: PropagationStep::default(),
            pending_rotation: NominalState::default().rotation(),
            history: History::reaching(config.horizon),
            vibration: [Vibration::default(); 2],
            now: Instant::ZERO,
            initialized: false,
            calibration: CalibrationResult::default(),
            command: EstimatorCommand::default(),
            anchor: None,
            surface: None,
            baro_offset: None,
            baro_updated: Instant::ZERO,
            field: None,
            acceleration: Acceleration::default(),
            steps: 0,
            bridge: Bridge::default(),
            rate: Vec3::zeros(),
            force: Vec3::zeros(),
            accels: Mean::default(),
            felt: Mean::default(),
            gates: Gates::default(),
            flow_innovation_bias: InnovationBiasMonitor::default(),
            fast_turn: FastTurn::default(),
            findings: SensorFindings::default(),
            range_gate: RangeGate::default(),
            range_used: Instant::ZERO,
            has_seen_floor: false,
            stood: None,
            status: EstimatorStatus::default(),
            alignment: Alignment::KNOWN,
            aiding_timeout: Duration::from_seconds(config.aiding_timeout),
            tallies: Tallies::default(),
            wander: Wander::default(),
        }
    }

    /// Restarts in place with another configuration. Afterwards the filter equals
    /// [`new`](Self::new)`(config)` bit for bit. For parameter changes on a small stack, where a
    /// second filter of 6 kB does not fit.
    ///
    /// ```
    /// use stampfly_eskf::{Eskf, EskfConfig};
    /// let mut filter = Eskf::new(EskfConfig::indoors());
    /// let other = EskfConfig { gate: 4.0, ..EskfConfig::indoors() };
    /// filter.begin_again(&other);
    /// assert_eq!(filter, Eskf::new(other));
    /// ```
    // The exhaustive pattern makes the compiler report a new field that is not reset here. Large
    // fields are changed in place and never copied.
    #[inline(never)]
    pub fn begin_again(&mut self, config: &EskfConfig) {
        let Self {
            noise,
            covariance,
            config: own,
            state,
            pending_step,
            pending_rotation,
            history,
            vibration,
            now,
            initialized,
            calibration,
            command,
            anchor,
            surface,
            baro_offset,
            baro_updated,
            field,
            acceleration,
            steps,
            bridge,
            rate,
            force,
            accels,
            felt,
            gates,
            flow_innovation_bias,
            fast_turn,
            findings,
            range_gate,
            range_used,
            has_seen_floor,
            stood,
            status,
            alignment,
            aiding_timeout,
            tallies,
            wander,
        } = self;
        *noise = process_noise(config);
        covariance.set_sigmas(initial_sigmas(config));
        *own = *config;
        *state = NominalState::default();
        *pending_step = PropagationStep::default();
        *pending_rotation = NominalState::default().rotation();
        history.reach(config.horizon);
        *vibration = [Vibration::default(); 2];
        *now = Instant::ZERO;
        *initialized = false;
        *calibration = CalibrationResult::default();
        *command = EstimatorCommand::default();
        *anchor = None;
        *surface = None;
        *baro_offset = None;
        *baro_updated = Instant::ZERO;
        *field = None;
        *acceleration = Acceleration::default();
        *steps = 0;
        *bridge = Bridge::default();
        *rate = Vec3::zeros();
        *force = Vec3::zeros();
        *accels = Mean::default();
        *felt = Mean::default();
        *gates = Gates::default();
        *flow_innovation_bias = InnovationBiasMonitor::default();
        *fast_turn = FastTurn::default();
        *findings = SensorFindings::default();
        *range_gate = RangeGate::default();
        *range_used = Instant::ZERO;
        *has_seen_floor = false;
        *stood = None;
        *status = EstimatorStatus::default();
        *alignment = Alignment::KNOWN;
        *aiding_timeout = Duration::from_seconds(config.aiding_timeout);
        *tallies = Tallies::default();
        *wander = Wander::default();
    }

    /// The covariance of the error state, for consistency checks and plots.
    #[must_use]
    pub fn covariance(&self) -> &Covariance {
        &self.covariance
    }

    /// The nominal state.
    #[must_use]
    pub fn nominal(&self) -> &NominalState {
        &self.state
    }

    /// The present state, for a measurement without delay.
    fn current_state(&self) -> DelayedState {
        DelayedState { state: self.state, rotation: self.state.rotation(), step: PropagationStep::default(), age: 0.0 }
    }

    /// Age of a measurement, s. Refuses measurements before initialisation, and those that are not
    /// finite, not new, too old or too far ahead. [`state_at`](Self::state_at) is a separate call,
    /// because a `Result` with a state next to a one-byte refusal is copied byte by byte: 700
    /// instructions per measurement.
    #[inline]
    fn admit(&mut self, sensor: Sensor, at: Instant, values: &[f32]) -> Result<f32, Refusal> {
        let age = self.place_in_time(at, values)?;
        if self.gates.is_new(sensor, at) { Ok(age) } else { Err(Refusal::Repeated) }
    }

    /// The same for sources that may deliver several measurements with one time stamp.
    #[inline]
    fn place_in_time(&self, at: Instant, values: &[f32]) -> Result<f32, Refusal> {
        if !self.initialized {
            return Err(Refusal::NotInitialized);
        }
        if !values.iter().all(|v| v.is_finite()) {
            return Err(Refusal::NotFinite);
        }
        let age = self.now.signed_seconds_since(at);
        if age > self.config.horizon {
            return Err(Refusal::Stale);
        }
        // Clocks of sensors differ slightly, so a small lead is accepted and extrapolated.
        if age < -MAX_AHEAD {
            return Err(Refusal::Future);
        }
        Ok(age)
    }

    /// State at the time of a measurement of this age, s. `None` when the history does not reach
    /// back so far, as right after the start.
    fn state_at(&self, age: f32) -> Option<DelayedState> {
        if age.abs() < SIMULTANEOUS {
            return Some(self.current_state());
        }
        let step = self.history.since(age)?;
        let state = step.state_at_start(&self.state);
        Some(DelayedState { state, rotation: state.rotation(), step, age })
    }

    /// Innovation of a measurement against the state at its time.
    #[inline]
    fn innovation<const M: usize>(
        &self,
        delayed: &DelayedState,
        rows: [Row; M],
        measured: [f32; M],
        variances: [f32; M],
    ) -> Innovation<M> {
        let mut innovations = measured;
        let mut jacobians = [[0.0; N]; M];
        for ((innovation, jacobian), row) in innovations.iter_mut().zip(&mut jacobians).zip(&rows) {
            *innovation -= row.predicted;
            *jacobian = row.jacobian;
        }
        // The rows refer to the state at the time of the measurement, the covariance to the present
        // state.
        if delayed.age != 0.0 {
            delayed.step.propagate_jacobians(&delayed.rotation, &mut jacobians);
        }
        self.covariance.innovation(&jacobians, innovations, variances)
    }

    /// Test ratio: normalised innovation squared divided by that of the gate. Above one, the
    /// measurement is outside.
    #[inline]
    fn test_ratio<const M: usize>(&self, innovation: &Innovation<M>) -> f32 {
        innovation.nis() / self.config.gate_distance(M)
    }

    /// Updates state and covariance with a measurement.
    #[inline]
    fn update<const M: usize>(&mut self, innovation: &Innovation<M>, ratio: f32) -> Fusion {
        let Some(correction) = self.covariance.try_update(innovation) else {
            return Fusion::Refused(Refusal::Implausible);
        };
        self.state.correct(&correction);
        Fusion::Fused { ratio }
    }

    /// Updates state and covariance with a pseudo-measurement, without a gate.
    fn constrain<const M: usize>(&mut self, rows: [Row; M], values: [f32; M], sigma: f32) {
        let innovation = self.innovation(&self.current_state(), rows, values, [sigma * sigma; M]);
        let ratio = self.test_ratio(&innovation);
        _ = self.update(&innovation, ratio);
    }

    /// Counters of a sensor's measurements since this filter was constructed; restarts do not clear
    /// them.
    ///
    /// ```
    /// use stampfly_eskf::{Aiding, Eskf, EskfConfig, Estimator, Refusal};
    /// use stampfly_types::{Instant, Vec3};
    /// let mut eskf = Eskf::new(EskfConfig::outdoors());
    /// _ = eskf.fuse_position(Instant::ZERO, &Vec3::zeros(), &Vec3::new(1.0, 1.0, f32::INFINITY));
    /// assert_eq!(eskf.tally(Aiding::Position).refused(Refusal::NotInitialized), 1);
    /// ```
    #[must_use]
    pub fn tally(&self, sensor: Aiding) -> Tally {
        self.tallies.of(sensor)
    }

    /// Adds a result to the counters.
    fn tallied(&mut self, sensor: Aiding, fusion: Fusion) -> Fusion {
        self.tallies.add(sensor, fusion);
        fusion
    }

    /// Tests an on-board sensor's measurement against its gate.
    #[inline(always)]
    fn test(&mut self, sensor: Sensor, ratio: f32) -> GateResult {
        self.gates.test(sensor, self.now, ratio, self.config.lockout, self.config.lockout_samples)
    }

    /// Whether the heading is known. With [`StartHeading::Nose`] it always is.
    fn is_north_known(&self) -> bool {
        !self.alignment.is_sought()
    }

    /// Whether an external measurement of this sensor was accepted within `aiding_timeout`.
    fn is_aided_outside(&self, sensor: Sensor) -> bool {
        self.gates.is_recent_within(sensor, self.now, self.aiding_timeout)
    }

    /// Counts a measurement in the status message and in the counters.
    fn count(&mut self, counter: Counter, fusion: Fusion) -> Fusion {
        let sensor = match counter {
            Counter::Tof => Aiding::Tof,
            Counter::Flow => Aiding::Flow,
            Counter::Baro => Aiding::Baro,
            Counter::Mag => Aiding::Mag,
            Counter::Gravity => Aiding::Gravity,
        };
        self.tallies.add(sensor, fusion);
        if let Some(offered) = self.status.offered.get_mut(counter as usize) {
            // These counters wrap; readers take differences.
            *offered = offered.wrapping_add(1);
        }
        if matches!(fusion, Fusion::Gated { .. })
            && let Some(refused) = self.status.refused.get_mut(counter as usize)
        {
            *refused = refused.wrapping_add(1);
        }
        fusion
    }

    /// Whether the velocity is measured, or held by the zero-velocity update.
    fn is_velocity_aided(&self) -> bool {
        let flow = self.gates.is_recent(Sensor::Flow, self.now) && !self.findings.flow.is_left_out();
        self.anchor.is_some() || flow || self.is_aided_outside(Sensor::Level)
    }

    /// Whether the vehicle left the ground within the duration of a take-off. Its velocity is then
    /// still known from standing; the camera sees nothing in the first centimetres.
    fn has_just_risen(&self) -> bool {
        self.stood.is_some_and(|stood| self.now.since(stood) < RISES) && !self.findings.flow.is_left_out()
    }

    /// Copies the uncertainties of motion and gyro into the status message.
    fn publish_sigmas(&mut self) {
        self.status.acceleration_sigma = self.acceleration_sigma();
        self.status.velocity_sigma = self.larger_sigma(VELOCITY);
        self.status.climb_sigma = self.sigma(VELOCITY + 2);
        self.status.gyro_bias_sigma = self.larger_sigma(GYRO_BIAS);
        self.status.yaw_bias_sigma = self.sigma(GYRO_BIAS + 2);
    }

    /// Standard deviation of the acceleration along body x and y of a vehicle carried by its
    /// thrust, m/s²: a rotation about y or x shifts gravity into that axis, and the accelerometer
    /// bias is added.
    fn acceleration_sigma(&self) -> f32 {
        let variance = |turn: usize, axis: usize, sign: f32| {
            let p = |i: usize, j: usize| self.covariance.get(i, j);
            // Variance of g·θ + b: a rotation about y shifts gravity into x, one about x into −y.
            let (turn, bias) = (ATTITUDE + turn, ACCEL_BIAS + axis);
            GRAVITY * (GRAVITY * p(turn, turn) + 2.0 * sign * p(turn, bias)) + p(bias, bias)
        };
        math::sqrt(math::larger(math::larger(variance(1, 0, 1.0), variance(0, 1, -1.0)), 0.0))
    }

    /// Larger standard deviation of the x and y components of a state; `x` is the index of the x
    /// component.
    fn larger_sigma(&self, x: usize) -> f32 {
        let [x, y] = [x, x + 1].map(|index| self.covariance.get(index, index));
        math::sqrt(math::larger(math::larger(x, y), 0.0))
    }

    /// Standard deviation of one state.
    fn sigma(&self, index: usize) -> f32 {
        math::sqrt(math::larger(self.covariance.get(index, index), 0.0))
    }

    /// Whether drag is used as a velocity measurement: only while no sensor measures velocity.
    fn feels_drag(&self) -> bool {
        self.config.drag > 0.0 && !self.command.accel_faulty && self.command.flying && !self.is_velocity_aided()
    }

    /// Whether the horizontal velocity is certain enough to be marked valid without a sensor.
    fn is_velocity_certain(&self) -> bool {
        let variance = |axis: usize| self.covariance.get(VELOCITY + axis, VELOCITY + axis);
        variance(0).max(variance(1)) < BRAKES * BRAKES
    }

    /// Height above the surface, m. An unknown surface counts as one ground clearance below the
    /// origin.
    fn height(&self) -> f32 {
        self.surface.unwrap_or(self.config.ground_clearance) - self.state.position.z
    }

    /// Whether a range holds the height.
    fn is_range_aided(&self) -> bool {
        self.gates.is_recent(Sensor::Tof, self.now) && !self.findings.range.is_left_out()
    }

    /// Applies the pseudo-measurements. Their conditions are listed in `pseudo_measurements.rs`.
    #[inline(never)]
    fn apply_pseudo_measurements(&mut self, accel: Vec3, dt: f32) {
        // Exactly one source applies: gravity and drag need the accelerometer, a stationary vehicle
        // has no acceleration of its own, and in flight a measured velocity observes the tilt
        // better than gravity.
        if self.command.accel_faulty {
            self.go_on_unfelt(dt);
        } else if self.anchor.is_some() {
            self.update_gravity(accel, &Vec3::zeros(), self.config.stationary_gravity_sigma);
        } else if !self.is_velocity_aided() {
            if self.feels_drag() {
                self.update_drag(accel, dt);
            } else if self.config.gravity_use == GravityUse::WhenUnaided {
                self.update_gravity(accel, &Vec3::zeros(), self.config.gravity_sigma);
            }
            self.reset_unobserved_motion();
        } else if self.state.cos_tilt() < self.config.min_cos_tilt && !self.is_aided_outside(Sensor::Level) {
            self.constrain_unobserved_velocity(dt);
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
    Covariance::from_sigmas(initial_sigmas(config))
}

/// Of position, velocity, attitude, gyro bias and accelerometer bias.
const fn initial_sigmas(config: &EskfConfig) -> [f32; 5] {
    [
        config.initial_position,
        config.initial_velocity,
        config.initial_attitude,
        config.initial_gyro_bias,
        config.initial_accel_bias,
    ]
}
