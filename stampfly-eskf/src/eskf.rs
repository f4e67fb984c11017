//! The error-state Kalman filter as an estimator: predict, update, gate, inflate, reset.
//!
//! The arithmetic is in [`filter`](crate::filter), the measurement models are in [`aid`](crate::aid), each with the
//! conditions for its start, continuation, stop and reset. Use this for anything that
//! flies indoors on an inertial sensor, optical flow and a range; use the
//! [`Complementary`](crate::Complementary) filter where a few hundred bytes must do.
//!
//! | file | what |
//! |---|---|
//! | `eskf.rs` | the filter's state, time alignment and update |
//! | `eskf/interface.rs` | its [`Estimator`]: initialise, command, predict, estimate |
//! | `eskf/bridge.rs` | inertial samples that are garbage |
//! | `eskf/unfelt.rs` | an accelerometer that does not measure |
//! | `eskf/measurements.rs` | one update a sensor |
//! | `eskf/external.rs` | position, velocity, attitude from outside; measurements with a model of one's own |
//! | `eskf/airspeed.rs` | airspeeds and the wind |
//! | `eskf/alignment.rs` | north, from how a measured velocity changes |
//! | `eskf/wander.rs` | how much of a receiver's error stays the same |
//! | `eskf/pseudo_measurements.rs` | updates without a sensor: stationary, gravity, drag, initial heading, unobserved velocity |
//! | `eskf/resets.rs` | what is put right when the estimate is found wrong: inflation, resets, restarts, health |
//! | `eskf/gate.rs` | innovation gates, lock-outs, count of resets |
//! | `eskf/range_gate.rs` | which ranges are compared at all |
//! | `eskf/fast_turn.rs` | turns that a camera does not follow |
//! | `eskf/innovation_bias.rs` | test of flow's innovations for a mean that is not zero |

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

/// Measurements from farther ahead than this are refused, s.
const MAX_AHEAD: f32 = 0.02;
/// Measurements this close in time to the last inertial sample are compared with the present state, s.
const SIMULTANEOUS: f32 = 0.5e-3;
/// Longest inertial step that is integrated; a longer gap is a gap.
const MAX_STEP: f32 = 0.5;
/// The state is propagated with every inertial sample, the covariance with the first sample after this much time, s: at
/// 400 Hz with every fourth one, for a quarter of the work. The covariance changes in tenths of seconds. (PX4's EKF2 takes
/// 10 ms, too: `EKF2_PREDICT_US`.)
const COVARIANCE_STEP: f32 = 9e-3;
/// Largest standard deviation of a velocity that the vehicle brakes by, m/s. Without flow it is seen by drag alone: at 0.4 1/s, a
/// velocity of 1 m/s is 0.4 m/s², as much as an accelerometer bias or a wind of 1 m/s.
const BRAKES: f32 = 1.5;
/// Below this height, m, the ground may carry it, and what it feels is no drag: it comes down level.
const LEVEL: f32 = 0.12;
/// A take-off is over after this time: at 0.03 m/s it has risen to where a camera sees.
const RISES: Duration = Duration::from_secs(3);
/// Pseudo-measurements are made on every n-th inertial sample.
const PSEUDO_MEASUREMENT_DIVIDER: u32 = 4;

/// Mean of the inertial samples between two updates with gravity.
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

    /// The mean, and of how many.
    fn take(&mut self) -> Option<(Vec3, f32)> {
        let Self { sum, count } = core::mem::take(self);
        (count > 0.0).then(|| (sum / count, count))
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
///         _ = eskf.fuse_tof(at, &TofData { distance: 0.5, valid: true, ..Default::default() });
///     }
/// }
/// let estimate = eskf.estimate();
/// assert!(estimate.valid.contains(Validity::HEIGHT));
/// assert!((estimate.height - 0.5).abs() < 0.01);
/// ```
// In this order in memory: the covariance, at whose elements all updates look, then what each sample looks at, then what is
// handed on as a whole. A load reaches 1020 bytes on a Cortex-M4F; the order is worth 3 % of the flight chain there.
#[repr(C)]
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Eskf {
    covariance: Covariance,
    now: Instant,
    baro_updated: Instant,
    /// That of the configuration, in the units of comparisons: asked for several times an inertial sample.
    aiding_timeout: Duration,
    config: EskfConfig,
    noise: ProcessNoise,
    state: NominalState,
    command: EstimatorCommand,
    /// Position of a stationary vehicle, while it is on the ground.
    anchor: Option<Vec3>,
    /// World down coordinate of the surface below.
    surface: Option<f32>,
    baro_offset: Option<Offset>,
    /// Direction of the magnetic field, world.
    field: Option<Vec3>,
    initialized: bool,
    steps: u32,
    rate: Vec3,
    force: Vec3,
    gates: Gates,
    status: EstimatorStatus,
    /// Inertial samples over which the covariance has yet to be propagated, and the attitude in which they began.
    pending_step: PropagationStep,
    pending_rotation: Rotation,
    acceleration: Acceleration,
    accels: Mean,
    /// The same with [`GravityUse::Always`].
    felt: Mean,
    /// Of the specific force and of the rate.
    vibration: [Vibration; 2],
    alignment: Alignment,
    flow_innovation_bias: InnovationBiasMonitor,
    bridge: Bridge,
    range_gate: RangeGate,
    /// When a range was compared last.
    range_used: Instant,
    /// In this flight the floor was once far enough away to be seen sharply.
    has_seen_floor: bool,
    /// When it last left the ground.
    stood: Option<Instant>,
    fast_turn: FastTurn,
    findings: SensorFindings,
    history: History,
    calibration: CalibrationResult,
    tallies: Tallies,
    wander: Wander,
}

/// The state at the time of a measurement: EKF2's delayed time horizon, computed back for each measurement.
struct DelayedState {
    state: NominalState,
    rotation: Rotation,
    /// Propagation since then.
    step: PropagationStep,
    /// Age of the measurement, s; zero for the present.
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
    // Made where it stays: a function of its own leaves a copy of 6 kB on the stack of whoever calls it.
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

    /// Begins again with this configuration, in its place: afterwards it is what [`new`](Self::new) makes, bit for bit. For a vehicle that is given other parameters on
    /// a small stack, where a second filter of 6 kB has no room.
    ///
    /// ```
    /// use stampfly_eskf::{Eskf, EskfConfig};
    /// let mut filter = Eskf::new(EskfConfig::indoors());
    /// let other = EskfConfig { gate: 4.0, ..EskfConfig::indoors() };
    /// filter.begin_again(&other);
    /// assert_eq!(filter, Eskf::new(other));
    /// ```
    // Each field by itself: whatever is added has to be added here, too, and none is copied whole that is large.
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

    /// Age of a measurement, s. Refuses measurements before initialisation, and those that are not finite, not new, too old or
    /// from the future. [`state_at`](Self::state_at) follows, and is not part of it: a result that holds a state beside a
    /// refusal of one byte is copied byte by byte, 700 instructions a measurement.
    #[inline]
    fn admit(&mut self, sensor: Sensor, at: Instant, values: &[f32]) -> Result<f32, Refusal> {
        let age = self.place_in_time(at, values)?;
        if self.gates.is_new(sensor, at) { Ok(age) } else { Err(Refusal::Repeated) }
    }

    /// The same for measurements of which several may have one stamp.
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
        if age < -MAX_AHEAD {
            return Err(Refusal::Future);
        }
        Ok(age)
    }

    /// The state at the time of a measurement of this age, s. `None` when the history does not go back so far, as right
    /// after the start.
    fn state_at(&self, age: f32) -> Option<DelayedState> {
        if age.abs() < SIMULTANEOUS {
            return Some(self.current_state());
        }
        let step = self.history.since(age)?;
        let state = step.state_at_start(&self.state);
        Some(DelayedState { state, rotation: state.rotation(), step, age })
    }

    /// Innovation of a measurement against the state of its time.
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
        if delayed.age != 0.0 {
            delayed.step.propagate_jacobians(&delayed.rotation, &mut jacobians);
        }
        self.covariance.innovation(&jacobians, innovations, variances)
    }

    /// Test ratio: normalised innovation squared over the gate's. Above one the measurement is outside the gate.
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

    /// What became of a sensor's measurements since this filter was made, restarts included.
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

    /// Counts what became of a measurement.
    fn tallied(&mut self, sensor: Aiding, fusion: Fusion) -> Fusion {
        self.tallies.add(sensor, fusion);
        fusion
    }

    /// Tests a measurement of a sensor on board against its gate.
    #[inline(always)]
    fn test(&mut self, sensor: Sensor, ratio: f32) -> GateResult {
        self.gates.test(sensor, self.now, ratio, self.config.lockout, self.config.lockout_samples)
    }

    /// Is north where this filter has it? The nose's north always is.
    fn is_north_known(&self) -> bool {
        !self.alignment.is_sought()
    }

    /// Does something from outside show horizontal position or velocity, or the vertical ones?
    fn is_aided_outside(&self, sensor: Sensor) -> bool {
        self.gates.is_recent_within(sensor, self.now, self.aiding_timeout)
    }

    /// Counts a measurement in the status.
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
            *offered = offered.wrapping_add(1);
        }
        if matches!(fusion, Fusion::Gated { .. })
            && let Some(refused) = self.status.refused.get_mut(counter as usize)
        {
            *refused = refused.wrapping_add(1);
        }
        fusion
    }

    /// Is the velocity measured, or held by the zero-velocity update?
    fn is_velocity_aided(&self) -> bool {
        let flow = self.gates.is_recent(Sensor::Flow, self.now) && !self.findings.flow.is_left_out();
        self.anchor.is_some() || flow || self.is_aided_outside(Sensor::Level)
    }

    /// Has it left the ground, where it stood still, so lately that it knows its velocity without a
    /// camera? That sees nothing of the first centimetres.
    fn has_just_risen(&self) -> bool {
        self.stood.is_some_and(|stood| self.now.since(stood) < RISES) && !self.findings.flow.is_left_out()
    }

    /// Says in the status how uncertain motion and gyro are.
    fn publish_sigmas(&mut self) {
        self.status.acceleration_sigma = self.acceleration_sigma();
        self.status.velocity_sigma = self.larger_sigma(VELOCITY);
        self.status.climb_sigma = self.sigma(VELOCITY + 2);
        self.status.gyro_bias_sigma = self.larger_sigma(GYRO_BIAS);
        self.status.yaw_bias_sigma = self.sigma(GYRO_BIAS + 2);
    }

    /// Standard deviation of the acceleration along body x and y of a vehicle that its thrust carries,
    /// m/s²: a turn about y or x takes gravity there, and an accelerometer's bias is one.
    fn acceleration_sigma(&self) -> f32 {
        let variance = |turn: usize, axis: usize, sign: f32| {
            let p = |i: usize, j: usize| self.covariance.get(i, j);
            let (turn, bias) = (ATTITUDE + turn, ACCEL_BIAS + axis);
            GRAVITY * (GRAVITY * p(turn, turn) + 2.0 * sign * p(turn, bias)) + p(bias, bias)
        };
        math::sqrt(math::larger(math::larger(variance(1, 0, 1.0), variance(0, 1, -1.0)), 0.0))
    }

    /// One standard deviation of the state whose part along x has this index, the larger of x and y.
    fn larger_sigma(&self, x: usize) -> f32 {
        let [x, y] = [x, x + 1].map(|index| self.covariance.get(index, index));
        math::sqrt(math::larger(math::larger(x, y), 0.0))
    }

    /// Standard deviation of one state.
    fn sigma(&self, index: usize) -> f32 {
        math::sqrt(math::larger(self.covariance.get(index, index), 0.0))
    }

    /// Does drag show the velocity? Only where nothing else does.
    fn feels_drag(&self) -> bool {
        self.config.drag > 0.0 && !self.command.accel_faulty && self.command.flying && !self.is_velocity_aided()
    }

    /// Is the horizontal velocity known well enough to brake by it?
    fn is_velocity_certain(&self) -> bool {
        let variance = |axis: usize| self.covariance.get(VELOCITY + axis, VELOCITY + axis);
        variance(0).max(variance(1)) < BRAKES * BRAKES
    }

    /// Height above the surface; a surface that is not known is where the vehicle would stand.
    fn height(&self) -> f32 {
        self.surface.unwrap_or(self.config.ground_clearance) - self.state.position.z
    }

    /// Does a range hold the height?
    fn is_range_aided(&self) -> bool {
        self.gates.is_recent(Sensor::Tof, self.now) && !self.findings.range.is_left_out()
    }

    /// Updates without a sensor of position or velocity. The conditions are listed in `pseudo_measurements.rs`.
    // Once in four steps or more: apart, so that the code of every step is short and can be kept in fast memory.
    #[inline(never)]
    fn apply_pseudo_measurements(&mut self, accel: Vec3, dt: f32) {
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

/// Of position, velocity, attitude and both biases.
const fn initial_sigmas(config: &EskfConfig) -> [f32; 5] {
    [
        config.initial_position,
        config.initial_velocity,
        config.initial_attitude,
        config.initial_gyro_bias,
        config.initial_accel_bias,
    ]
}
