//! External measurements: position, velocity, attitude, and sensors with a user's model.
//!
//! Each axis has its own standard deviation. An axis with an infinite one, or one of at least a
//! thousand kilometres, was not measured. For on-board sensors see
//! [`measurements`](super::measurements).

use super::alignment::Step;
use super::gate::{GateResult, Sensor};
use super::pseudo_measurements::ANY_ATTITUDE;
use super::wander::limited;
use super::*;
use crate::measurements::Aiding;

/// Smallest variances accepted: of a velocity, (m/s)², and of a position, m².
const LEAST_VELOCITY: f32 = 1e-6;
const LEAST_POSITION: f32 = 1e-8;
/// Position variance above which the position counts as unknown, m²: a kilometre. The first fix
/// then sets it.
const NOWHERE: f32 = 1e6;

/// An axis with at least this standard deviation, m or m/s, was not measured. Squares of larger
/// ones overflow.
const NOT_MEASURED: f32 = 1e6;

/// Plausibility limits per state: position m, velocity m/s, attitude rad, gyro bias rad/s,
/// accelerometer bias m/s². They bound absolute measurements of position and velocity, and the
/// correction by one measurement.
const FARTHEST: [f32; N] = [1e7, 1e7, 1e7, 1e4, 1e4, 1e4, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 100.0, 100.0, 100.0];

/// Share of an excessive position certainty that each fix takes back when the receiver's error
/// proves to be constant.
const TAKEN_BACK: f32 = 0.1;

/// A world vector whose axes may be missing, with its prediction.
struct Axes {
    rows: [Row; 3],
    measured: [f32; 3],
    variances: [f32; 3],
    given: [bool; 3],
}

impl Axes {
    /// An axis that is not given has a zero Jacobian and a zero innovation.
    fn new(mut rows: [Row; 3], values: &Vec3, sigma: &Vec3, least: f32) -> Self {
        let mut axes = Self { rows, measured: (*values).into(), variances: [1.0; 3], given: [true; 3] };
        for axis in 0..3 {
            if says_nothing(sigma[axis]) {
                axes.given[axis] = false;
                rows[axis].jacobian = [0.0; N];
                axes.measured[axis] = rows[axis].predicted;
            } else {
                axes.variances[axis] = (sigma[axis] * sigma[axis]).max(least);
            }
        }
        axes.rows = rows;
        axes
    }

    /// Whether a component exceeds what any vehicle reaches.
    fn are_beyond(&self, farthest: f32) -> bool {
        self.measured.iter().any(|value| value.abs() > farthest)
    }

    fn count(&self) -> usize {
        self.given.iter().filter(|given| **given).count()
    }

    /// Removes the horizontal axes.
    fn drop_level(&mut self) {
        for axis in 0..2 {
            self.given[axis] = false;
            self.rows[axis].jacobian = [0.0; N];
            self.measured[axis] = self.rows[axis].predicted;
            self.variances[axis] = 1.0;
        }
    }
}

/// Whether an axis with this standard deviation was not measured.
const fn says_nothing(sigma: f32) -> bool {
    sigma.abs() >= NOT_MEASURED
}

/// The values to check for NaN and infinity: axes that were not measured count as zero, and a NaN
/// standard deviation makes its axis NaN.
fn is_given(values: &Vec3, sigma: &Vec3) -> [f32; 3] {
    let given = |value: f32, sigma: f32| match sigma {
        _ if sigma.is_nan() => f32::NAN,
        _ if says_nothing(sigma) => 0.0,
        _ => value,
    };
    let ([north, east, down], [of_north, of_east, of_down]) = (values.to_array(), sigma.to_array());
    [given(north, of_north), given(east, of_east), given(down, of_down)]
}

impl Eskf {
    #[inline(never)]
    pub(super) fn update_velocity(&mut self, at: Instant, velocity: &Vec3, sigma: &Vec3) -> Result<Fusion, Refusal> {
        let age = self.admit(Sensor::Velocity, at, &is_given(velocity, sigma))?;
        let Some(delayed) = &self.state_at(age) else { return Err(Refusal::Stale) };
        let mut axes = Axes::new(aid::velocity::world(&delayed.state), velocity, sigma, LEAST_VELOCITY);
        if axes.are_beyond(FARTHEST[VELOCITY]) {
            return Err(Refusal::Implausible);
        }
        if !self.is_north_known() && axes.given[0] && axes.given[1] {
            self.align(at, delayed, &axes);
            axes.drop_level();
        }
        if axes.count() == 0 {
            return if self.is_north_known() { Err(Refusal::Missing) } else { Ok(Fusion::Fused { ratio: 0.0 }) };
        }
        let innovation = self.innovation(delayed, axes.rows, axes.measured, axes.variances);
        let ratio = innovation.nis() / self.config.gate_distance(axes.count());
        self.acceleration.update(at, axes.measured.into());
        match self.test_external(Sensor::Velocity, ratio) {
            GateResult::Fuse => {
                self.aided(&axes.given);
                Ok(self.update(&innovation, ratio))
            }
            GateResult::Reject => Ok(Fusion::Gated { ratio }),
            GateResult::Reset => {
                self.aided(&axes.given);
                // Apply the jump to the present state: the change since the measurement is known
                // from the inertial sensor.
                self.state.velocity += Vec3::from(axes.measured) - delayed.state.velocity;
                for axis in 0..3 {
                    if axes.given[axis] {
                        self.covariance.reset(VELOCITY + axis, 4.0 * axes.variances[axis]);
                    }
                    self.covariance.inflate(ATTITUDE + axis, 0.01);
                }
                Ok(self.finish_reset(Sensor::Velocity))
            }
        }
    }

    #[inline(never)]
    pub(super) fn update_position(&mut self, at: Instant, position: &Vec3, sigma: &Vec3) -> Result<Fusion, Refusal> {
        let age = self.admit(Sensor::Position, at, &is_given(position, sigma))?;
        let Some(delayed) = &self.state_at(age) else { return Err(Refusal::Stale) };
        let mut axes = Axes::new(aid::position::world(&delayed.state), position, sigma, LEAST_POSITION);
        if axes.are_beyond(FARTHEST[POSITION]) {
            return Err(Refusal::Implausible);
        }
        // The first fix of an axis defines its position; a gate could not test it.
        let first = core::array::from_fn::<_, 3, _>(|axis| axes.given[axis] && self.is_nowhere(axis));
        if !self.is_north_known() || first.contains(&true) {
            // Without a heading the inertial sensor cannot propagate the position from fix to fix:
            // set it at each fix.
            let placed =
                core::array::from_fn(|axis| first[axis] || (axis < 2 && axes.given[axis] && !self.is_north_known()));
            self.place(delayed, &axes, placed);
            if !self.is_north_known() {
                axes.drop_level();
            }
            if first.contains(&true) || axes.count() == 0 {
                self.aided(&first);
                self.gates.accept(Sensor::Position, self.now);
                return Ok(Fusion::Fused { ratio: 0.0 });
            }
        }
        if axes.count() == 0 {
            return Err(Refusal::Missing);
        }
        let innovation = self.innovation(delayed, axes.rows, axes.measured, axes.variances);
        let ratio = innovation.nis() / self.config.gate_distance(axes.count());
        match self.test_external(Sensor::Position, ratio) {
            GateResult::Fuse if self.config.position_wander => {
                self.aided(&axes.given);
                Ok(self.update_wandering(at, delayed, &axes, ratio))
            }
            GateResult::Fuse => {
                self.aided(&axes.given);
                Ok(self.update(&innovation, ratio))
            }
            GateResult::Reject => Ok(Fusion::Gated { ratio }),
            GateResult::Reset => {
                self.aided(&axes.given);
                self.place(delayed, &axes, axes.given);
                for axis in 0..3 {
                    if axes.given[axis] {
                        self.covariance.reset(VELOCITY + axis, 1.0);
                    }
                    self.covariance.inflate(ATTITUDE + axis, 0.01);
                }
                Ok(self.finish_reset(Sensor::Position))
            }
        }
    }

    /// Updates with a position whose error may be constant from fix to fix.
    fn update_wandering(&mut self, at: Instant, delayed: &DelayedState, axes: &Axes, ratio: f32) -> Fusion {
        let follows =
            self.wander.fix(at, core::array::from_fn(|axis| axes.measured[axis] - delayed.state.position[axis]));
        let mut variances = axes.variances;
        for (axis, variance) in variances.iter_mut().enumerate() {
            let floor = if follows { self.wander.floor(axis, *variance) } else { 0.0 };
            let prior = self.covariance.get(POSITION + axis, POSITION + axis);
            *variance = limited(prior, *variance, floor);
            // The first fixes were treated as white noise, before their differences showed
            // otherwise: take back the certainty gained from them.
            self.covariance.inflate(POSITION + axis, TAKEN_BACK * (floor - prior).max(0.0));
        }
        let before = self.state.position;
        let innovation = self.innovation(delayed, axes.rows, axes.measured, variances);
        let fusion = self.update(&innovation, ratio);
        self.wander.moved((self.state.position - before).into());
        fusion
    }

    /// Whether the position along this axis is unknown.
    pub(super) fn is_nowhere(&self, axis: usize) -> bool {
        self.covariance.get(POSITION + axis, POSITION + axis) > NOWHERE
    }

    /// Sets the position to a measured one along these axes.
    fn place(&mut self, delayed: &DelayedState, axes: &Axes, along: [bool; 3]) {
        let jump = Vec3::from(axes.measured) - delayed.state.position;
        for axis in 0..3 {
            if along[axis] {
                self.state.position[axis] += jump[axis];
                self.covariance.reset(POSITION + axis, 4.0 * axes.variances[axis]);
            }
        }
        if along[2] {
            // The surface moves with the vehicle: the height above it has not changed.
            self.surface = self.surface.map(|surface| surface + jump.z);
        }
    }

    fn test_external(&mut self, sensor: Sensor, ratio: f32) -> GateResult {
        self.gates.test(sensor, self.now, ratio, self.config.external_lockout, self.config.lockout_samples)
    }

    /// Records an external measurement of position or velocity along these axes.
    pub(super) fn aided(&mut self, [north, east, down]: &[bool; 3]) {
        if *north || *east {
            self.gates.accept(Sensor::Level, self.now);
        }
        if *down {
            self.gates.accept(Sensor::Down, self.now);
        }
    }

    /// Passes a horizontal velocity to the heading search.
    fn align(&mut self, at: Instant, delayed: &DelayedState, axes: &Axes) {
        self.gates.accept(Sensor::Velocity, self.now);
        self.gates.accept(Sensor::Level, self.now);
        let [north, east, _] = axes.measured;
        let (felt, variance) = (delayed.state.velocity, axes.variances[0].max(axes.variances[1]));
        match self.alignment.step(at, [felt.x, felt.y], [north, east], variance) {
            Step::Waits => {}
            Step::Window => self.follow(delayed, axes),
            Step::Found { turn, sigma } => {
                self.turn_to_north(turn, sigma);
                // The rotation of the world frame has changed the delayed state, too.
                let Some(delayed) = &self.state_at(delayed.age) else { return };
                self.follow(delayed, axes);
            }
        }
    }

    /// Sets the horizontal velocity to a measured one.
    fn follow(&mut self, delayed: &DelayedState, axes: &Axes) {
        for axis in 0..2 {
            self.state.velocity[axis] += axes.measured[axis] - delayed.state.velocity[axis];
            self.covariance.reset(VELOCITY + axis, 4.0 * axes.variances[axis] + 0.04);
        }
    }

    #[inline(never)]
    pub(super) fn update_attitude(&mut self, at: Instant, attitude: &Quat, sigma: f32) -> Result<Fusion, Refusal> {
        let [w, x, y, z] = attitude.wxyz();
        let age = self.admit(Sensor::Attitude, at, &[w, x, y, z, sigma])?;
        if !(0.9..=1.1).contains(&attitude.norm_squared()) {
            // An unchecked quaternion may not have unit length.
            return Err(Refusal::Implausible);
        }
        let Some(delayed) = &self.state_at(age) else { return Err(Refusal::Stale) };
        let variance = (sigma * sigma).max(1e-8);
        let error = aid::attitude::error(delayed.state.attitude, [w, x, y, z]);
        let innovation = self.innovation(delayed, aid::attitude::rows(), error.into(), [variance; 3]);
        let ratio = self.test_ratio(&innovation);
        let verdict =
            if self.is_north_known() { self.test_external(Sensor::Attitude, ratio) } else { GateResult::Reset };
        match verdict {
            GateResult::Fuse => Ok(self.update(&innovation, ratio)),
            GateResult::Reject => Ok(Fusion::Gated { ratio }),
            GateResult::Reset => {
                // Carry the measured attitude to the present by the rotation since then.
                self.state.attitude = multiply([w, x, y, z], delayed.step.delta_rotation);
                self.reset_history();
                for axis in 0..3 {
                    self.covariance.reset(ATTITUDE + axis, math::smaller(4.0 * variance, ANY_ATTITUDE));
                    self.covariance.inflate(VELOCITY + axis, 0.1);
                    self.covariance.inflate(GYRO_BIAS + axis, 1e-5);
                }
                self.alignment.found();
                Ok(self.finish_reset(Sensor::Attitude))
            }
        }
    }

    /// Fuses a measurement with a user's model.
    ///
    /// `model` receives the state at `at`, which may be as late as the
    /// [`horizon`](EskfConfig::horizon). It returns, for each axis, the predicted reading in that
    /// state and its derivatives by the fifteen [errors](crate::filter): position (0–2) and
    /// velocity (3–5) in the world, attitude (6–8) as a small rotation of the body, gyro bias
    /// (9–11), accelerometer bias (12–14). `variances` are the noise variances of the axes in the
    /// squared unit of the measurement, positive and independent. `gate` is in standard deviations;
    /// infinity accepts everything.
    ///
    /// A rejected measurement is left out and never resets the state: the filter does not know
    /// which part of it is wrong. Repeated time stamps are accepted, because several sensors may
    /// share this function. While the heading is unknown, models that depend on horizontal position
    /// or velocity are refused as [`Refusal::Missing`].
    ///
    /// Example: wheel speed and the range to a beacon. For an airspeed see
    /// [`fuse_airspeed`](Estimator::fuse_airspeed).
    ///
    /// ```
    /// use stampfly_eskf::{Eskf, EskfConfig, Estimator, StartHeading, aid::{Row, velocity}, filter::{NominalState, POSITION}};
    /// use stampfly_types::{Instant, Vec3, messages::{CalibrationResult, ImuData}};
    ///
    /// let still = Vec3::new(0.0, 0.0, -9.80665);
    /// let start_heading = StartHeading::Given { heading: 0.0, sigma: 0.02 };
    /// let mut eskf = Eskf::new(EskfConfig { start_heading, initial_position: 5.0, ..EskfConfig::outdoors() });
    /// eskf.initialize(Instant::ZERO, &CalibrationResult { specific_force: still, ..Default::default() });
    /// let beacon = Vec3::new(30.0, 40.0, 0.0);
    /// for k in 1..=400u64 {
    ///     let at = Instant::from_micros(k * 5_000);
    ///     eskf.predict(at, &ImuData { accel: still, ..Default::default() });
    ///     if k % 10 != 0 {
    ///         continue;
    ///     }
    ///     // A wheel, m/s: the velocity along body x, and no sideways slip along y.
    ///     let speed = |state: &NominalState| { let [x, y, _] = velocity::body(state); [x, y] };
    ///     assert!(eskf.fuse(at, speed, [0.0, 0.0], [0.04, 0.01], 5.0).is_fused());
    ///     // A range to a beacon, m, a fifth of a second late.
    ///     let range = |state: &NominalState| {
    ///         let away = state.position - beacon;
    ///         let distance = away.norm().max(0.1);
    ///         let [x, y, z] = [away.x / distance, away.y / distance, away.z / distance];
    ///         [Row::new(distance, [(POSITION, x), (POSITION + 1, y), (POSITION + 2, z)])]
    ///     };
    ///     if k > 50 {
    ///         assert!(eskf.fuse(Instant::from_micros(k * 5_000 - 200_000), range, [48.0], [0.25], 5.0).is_fused());
    ///     }
    /// }
    /// // The position has moved two metres towards the beacon.
    /// assert!(((eskf.estimate().position - beacon).norm() - 48.0).abs() < 0.3);
    /// ```
    ///
    /// # Errors
    /// Returns [`Fusion::Refused`] before initialisation, for a time outside the history or too far
    /// ahead, for values that are not finite, for variances that are not positive, and for
    /// corrections beyond any vehicle.
    pub fn fuse<const M: usize>(
        &mut self,
        at: Instant,
        model: impl FnOnce(&NominalState) -> [Row; M],
        measured: [f32; M],
        variances: [f32; M],
        gate: f32,
    ) -> Fusion {
        let fusion = self.update_own(at, model, measured, variances, gate).unwrap_or_else(Fusion::Refused);
        self.tallied(Aiding::Own, fusion)
    }

    fn update_own<const M: usize>(
        &mut self,
        at: Instant,
        model: impl FnOnce(&NominalState) -> [Row; M],
        measured: [f32; M],
        variances: [f32; M],
        gate: f32,
    ) -> Result<Fusion, Refusal> {
        let age = self.place_in_time(at, &measured)?;
        let Some(delayed) = &self.state_at(age) else { return Err(Refusal::Stale) };
        let rows = model(&delayed.state);
        let finite = |row: &Row| row.predicted.is_finite() && row.jacobian.iter().all(|v| v.is_finite());
        if !rows.iter().all(finite) || !variances.iter().all(|v| v.is_finite() && *v > 0.0) || gate.is_nan() {
            return Err(Refusal::NotFinite);
        }
        let sees = |state: usize| rows.iter().any(|row| row.jacobian.get(state).is_some_and(|v| *v != 0.0));
        let given = core::array::from_fn(|axis| sees(POSITION + axis) || sees(VELOCITY + axis));
        if !self.is_north_known() && (given[0] || given[1]) {
            return Err(Refusal::Missing);
        }
        let innovation = self.innovation(delayed, rows, measured, variances);
        let ratio = innovation.nis() / (gate * gate * EskfConfig::axes_factor(M));
        // Written so that a NaN ratio is rejected.
        if ratio <= 1.0 {
            // An infinite gate accepts any innovation, so bound the correction itself.
            let moves = innovation.correction();
            if !moves.iter().zip(FARTHEST).all(|(moves, most)| moves.abs() < most) {
                return Err(Refusal::Implausible);
            }
            self.aided(&given);
            Ok(self.update(&innovation, ratio))
        } else {
            Ok(Fusion::Gated { ratio })
        }
    }

    /// Zero-velocity update at `at`, with the standard deviation of each axis, m/s. For a caller
    /// that knows from another source that the vehicle stands: wheels that do not turn, a closed
    /// clamp. Valid together with late velocities of a receiver. While the heading is unknown it
    /// constrains the vertical velocity only.
    pub fn fuse_zero_velocity(&mut self, at: Instant, sigma: f32) -> Fusion {
        let variance = sigma * sigma;
        let gate = self.config.gate;
        if self.is_north_known() {
            return self.fuse(at, aid::velocity::world, [0.0; 3], [variance; 3], gate);
        }
        let down = |state: &NominalState| {
            let [_, _, down] = aid::velocity::world(state);
            [down]
        };
        self.fuse(at, down, [0.0], [variance], gate)
    }
}
