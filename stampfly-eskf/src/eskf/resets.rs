//! Inflation, resets and restarts of a wrong estimate.
//!
//! - **Lock-out of a sensor** ([`gate`](super::gate)): its update resets the state that it
//!   measures; [`finish_reset`](Eskf::finish_reset) counts it towards divergence.
//! - **Biased flow innovations** ([`innovation_bias`](super::innovation_bias)): inflates tilt and
//!   gyro bias. Counts towards divergence.
//! - **Turn too fast for flow**: inflates the tilt.
//! - **Finding of a monitor** ([`correct`](crate::Estimator::correct)): corrects attitude, velocity
//!   and biases.
//! - **[`check_health`](Eskf::check_health)**: a state that is not finite or an unsound covariance
//!   restarts position and velocity, on the ground everything, and reports divergence. A position
//!   or velocity beyond any flight only reports divergence; the caller may then command a full
//!   reset.

use super::*;

/// Tilt standard deviation after a turn too fast for flow, as a share of the angle: 3 % for errors
/// of the gyro's scale and axes, and as much for a zero that has shifted meanwhile.
const TURNED: f32 = 0.05;
/// Standard deviations added to tilt, rad, and gyro bias, rad/s, when flow innovations are biased
/// and after a reset to flow.
const TILT_INFLATION: f32 = 0.1;
const GYRO_BIAS_INFLATION: f32 = 0.03;
/// Standard deviation added to the tilt when the heading is found, rad.
const ALIGNED_TILT: f32 = 0.03;
/// Standard deviation of the velocity after a restart in flight, m/s.
const RESTART_VELOCITY: f32 = 3.0;
/// Share of `max_position` beyond which a position is discarded at a restart in flight.
const KEPT_POSITION: f32 = 0.5;

impl Eskf {
    /// Clears the history: after a reset of the attitude its velocity changes have the wrong
    /// direction, and after a gap the wrong time. Late measurements are refused until it has filled
    /// again.
    pub(super) fn reset_history(&mut self) {
        self.history.clear();
        self.pending_step = PropagationStep::default();
        self.pending_rotation = self.state.rotation();
    }

    /// Counts a reset of the state to a sensor after its lock-out.
    pub(super) fn finish_reset(&mut self, sensor: Sensor) -> Fusion {
        self.status.resets = self.status.resets.wrapping_add(1);
        self.status.diverged |= self.gates.record_reset(sensor, self.now);
        Fusion::Reset
    }

    /// Inflates tilt and gyro bias after biased flow innovations. Counts as a reset, so that many
    /// in sequence report divergence.
    pub(super) fn inflate_on_innovation_bias(&mut self) {
        self.inflate_tilt();
        self.status.diverged |= self.gates.count_reset(self.now);
    }

    /// Inflates the tilt and the gyro bias that may have caused it.
    pub(super) fn inflate_tilt(&mut self) {
        for axis in 0..2 {
            self.covariance.inflate(ATTITUDE + axis, TILT_INFLATION * TILT_INFLATION);
            self.covariance.inflate(GYRO_BIAS + axis, GYRO_BIAS_INFLATION * GYRO_BIAS_INFLATION);
            // Flow cannot distinguish tilt from accelerometer bias: estimate the bias again.
            self.reset_accel_bias(axis);
        }
    }

    /// Inflates the tilt after a turn by `angle`, rad, that was too fast for flow.
    pub(super) fn inflate_turned(&mut self, angle: f32) {
        let tilt = TURNED * angle;
        for axis in 0..2 {
            self.covariance.inflate(ATTITUDE + axis, tilt * tilt);
        }
    }

    /// Applies a monitor's correction. Ignored before initialisation and if a value is not finite.
    #[inline(never)]
    pub(super) fn correct_by(&mut self, correction: &EstimateCorrection) {
        let EstimateCorrection { turn, velocity, down, gyro_bias, accel_bias, .. } = correction;
        let numbers = [turn, velocity, gyro_bias, accel_bias].map(Vec3::norm_squared);
        if !self.initialized || !numbers.into_iter().all(f32::is_finite) || !down.is_finite() {
            return;
        }
        // The turn is a rotation vector in the world, so it multiplies from the left.
        let (sin, cos) = math::sin_cos(0.5 * turn.norm());
        let axis = turn * (sin / math::larger(turn.norm(), f32::MIN_POSITIVE));
        self.state.attitude = multiply([cos, axis.x, axis.y, axis.z], self.state.attitude);
        self.state.velocity += velocity;
        self.state.position.z += down;
        self.state.gyro_bias += gyro_bias;
        self.state.accel_bias += accel_bias;
        // A restart must not return to the bias of the faulty sensor.
        self.calibration.gyro_bias = self.state.gyro_bias;
        let square = |sigma: f32| if sigma.is_finite() { sigma * sigma } else { 0.0 };
        if correction.climb_sigma > 0.0 {
            self.covariance.reset(VELOCITY + 2, square(correction.climb_sigma));
            self.covariance.inflate(POSITION + 2, 0.1);
            self.covariance.reset(ACCEL_BIAS + 2, 0.1);
            // The barometer's offset was learnt with the wrong height.
            self.baro_offset = None;
        }
        for axis in (0..2).filter(|_| correction.tilt_sigma > 0.0) {
            self.covariance.inflate(ATTITUDE + axis, square(correction.tilt_sigma));
            self.covariance.inflate(GYRO_BIAS + axis, square(correction.gyro_bias_sigma));
            self.covariance.inflate(VELOCITY + axis, square(correction.velocity_sigma));
            self.covariance.reset(ACCEL_BIAS + axis, square(self.config.initial_accel_bias));
        }
        self.reset_history();
        self.status.resets = self.status.resets.wrapping_add(1);
    }

    /// Rotates the world frame about the vertical by `turn`, rad, once the heading has been found.
    /// The heading then has the standard deviation `sigma`, rad; the tilt gains that of a vehicle
    /// that moved without aiding.
    pub(super) fn turn_to_north(&mut self, turn: f32, sigma: f32) {
        let (sin, cos) = math::sin_cos(0.5 * turn);
        let turn = [cos, 0.0, 0.0, sin];
        self.state.attitude = multiply(turn, self.state.attitude);
        let rotation = rotation_matrix(turn);
        self.history.turn(&rotation);
        self.state.velocity = rotate(&rotation, &self.state.velocity);
        self.pending_step = PropagationStep::default();
        self.pending_rotation = self.state.rotation();
        let vertical = self.pending_rotation[2];
        // The heading's variance about the vertical, and a tilt variance on all axes.
        for (axis, part) in vertical.iter().enumerate() {
            self.covariance.inflate(ATTITUDE + axis, part * part * sigma * sigma + ALIGNED_TILT * ALIGNED_TILT);
        }
        self.alignment.found();
    }

    /// Restarts position and velocity in flight. Attitude, heading and biases are better than those
    /// of the calibration at power-on, so they stay; their variances grow by what may have driven
    /// the estimate away.
    pub(super) fn restart_motion(&mut self) {
        let mut variances = initial_covariance(&self.config);
        for axis in 0..3 {
            for (block, limit) in [(ATTITUDE, 1.0), (GYRO_BIAS, 0.1), (ACCEL_BIAS, 2.0)] {
                // An unsound covariance holds no information: take the limit.
                let before = self.covariance.get(block + axis, block + axis);
                let before = if before.is_finite() { before.max(0.0).min(limit) } else { limit };
                variances.reset(block + axis, before);
            }
            variances.reset(VELOCITY + axis, RESTART_VELOCITY * RESTART_VELOCITY);
        }
        self.covariance = variances;
        for axis in 0..2 {
            self.covariance.inflate(ATTITUDE + axis, TILT_INFLATION * TILT_INFLATION);
        }
        for axis in 0..3 {
            self.covariance.inflate(GYRO_BIAS + axis, GYRO_BIAS_INFLATION * GYRO_BIAS_INFLATION);
            self.covariance.inflate(ACCEL_BIAS + axis, self.config.initial_accel_bias * self.config.initial_accel_bias);
        }
        // The origin is a matter of definition, and a position controller would fly back after a
        // jump: keep it.
        let kept = KEPT_POSITION * self.config.max_position;
        self.state.position = self.state.position.map(|axis| if axis.abs() < kept { axis } else { 0.0 });
        self.state.velocity = Vec3::zeros();
        self.surface = None;
        self.baro_offset = None;
        self.baro_updated = self.now;
        self.acceleration = Acceleration::default();
        self.accels = Mean::default();
        self.felt = Mean::default();
        self.gates = Gates::default();
        self.flow_innovation_bias = InnovationBiasMonitor::default();
        self.fast_turn = FastTurn::default();
        self.range_gate = RangeGate::default();
        self.reset_history();
        self.status.diverged = false;
    }

    /// Restarts after divergence: on the ground, or with an attitude that is not finite, from the
    /// last calibration; in flight position and velocity only.
    pub(super) fn restart(&mut self) {
        let (at, calibration, status) = (self.now, self.calibration, self.status);
        if self.anchor.is_some() || !self.state.is_finite() {
            self.initialize(at, &calibration);
            self.status = status;
        } else {
            self.restart_motion();
        }
        self.status.resets = status.resets.wrapping_add(1);
        self.status.diverged = true;
    }

    /// Restarts a filter whose state is not finite or whose covariance is unsound, and reports
    /// divergence of position or velocity beyond any flight. Not tested: a horizontal position
    /// without aiding, which is marked invalid anyway; and, while the vehicle is not commanded to
    /// fly, an unmeasured horizontal velocity and a height never measured.
    pub(super) fn check_health(&mut self) {
        let NominalState { position, velocity, .. } = &self.state;
        let EskfConfig { max_velocity, max_position, .. } = self.config;
        if !self.state.is_finite() || (self.steps.is_multiple_of(128) && !self.covariance.is_healthy()) {
            self.restart();
        } else if (velocity.horizontal().amax() > max_velocity && (self.command.flying || self.is_velocity_aided()))
            || ((velocity.z.abs() > max_velocity || position.z.abs() > max_position) && self.claims_height())
            || (position.horizontal().amax() > max_position && self.is_velocity_aided())
        {
            self.status.diverged = true;
        }
    }

    /// Whether the vertical position is more than the integral of the inertial sensor.
    fn claims_height(&self) -> bool {
        let measured = self.surface.is_some() || self.baro_offset.is_some() || self.is_aided_outside(Sensor::Down);
        self.command.flying || measured
    }
}
