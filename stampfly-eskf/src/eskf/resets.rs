//! What is put right when the estimate is found to be wrong.
//!
//! | found by | put right | counts towards divergence |
//! |---|---|---|
//! | the lock-out of a sensor ([`gate`](super::gate)) | the state that it measures, by its update; [`finish_reset`](Eskf::finish_reset) | yes |
//! | flow's innovations ([`innovation_bias`](super::innovation_bias)) | variance of tilt and gyro bias | yes |
//! | a turn that is faster than flow follows | variance of the tilt | no |
//! | the second opinion about the range ([`vertical`](super::vertical)) | climb rate, height, vertical accelerometer bias | no |
//! | the second opinion about flow ([`flow_monitor`](super::flow_monitor)) | what flow did to tilt, gyro bias and velocity in the last second, or since the take-off | no |
//! | the course of flow's difference ([`gyro`](super::flow_monitor)) | gyro bias, tilt, horizontal velocity | no |
//! | the picture of the floor ([`gyro_monitor`](super::gyro_monitor)) | gyro bias, tilt, horizontal velocity | no |
//! | [`check_health`](Eskf::check_health): a state that is no number or beyond any flight | position and velocity, on the ground everything | it is divergence |

use super::*;

/// Standard deviation of the tilt after a turn that flow did not see, share of the turn: errors of
/// the gyro's scale and axes, of which 3 % are usual, and as much for a zero that has shifted
/// meanwhile.
const TURNED: f32 = 0.05;
/// Standard deviations added to tilt and gyro bias when flow's innovations are biased, and after a reset to flow: rad
/// and rad/s.
const TILT_INFLATION: f32 = 0.1;
const GYRO_BIAS_INFLATION: f32 = 0.03;
/// Uncertain share of a jump of the gyro's, and uncertain velocity after it, m/s.
const JUMP_UNCERTAIN: f32 = 0.2;
const JUMP_VELOCITY: f32 = 0.1;
/// For how long what is left of a jump turns the tilt, s.
const SETTLES: f32 = 0.5;
/// What is left when a second of lies is undone: standard deviations of tilt, rad, gyro bias, rad/s, and velocity, m/s.
const LIE_TILT: f32 = 0.03;
const LIE_GYRO_BIAS: f32 = 0.01;
const LIE_VELOCITY: f32 = 0.3;
/// Standard deviations of tilt, rad, and gyro bias, rad/s, that a shift of the gyro's zero leaves: a tenth of 0.5 rad/s and its tilt.
const SHIFT_TILT: f32 = 0.05;
const SHIFT_GYRO_BIAS: f32 = 0.05;
/// Standard deviation of the gyro's bias after one on the ground, rad/s.
const STANDING_SHIFT: f32 = 0.01;
/// Standard deviation that the tilt gains until north is found, rad.
const ALIGNED_TILT: f32 = 0.03;
/// Standard deviation of the velocity after a restart in flight, m/s.
const RESTART_VELOCITY: f32 = 3.0;
/// A position beyond this share of the largest does not survive a restart in flight.
const KEPT_POSITION: f32 = 0.5;

impl Eskf {
    /// Empties the history: after a reset of the attitude its velocity changes point elsewhere, after a gap their time
    /// is wrong. Late measurements are refused until it has filled again.
    pub(super) fn reset_history(&mut self) {
        self.history.clear();
        self.pending_step = PropagationStep::default();
        self.pending_rotation = self.state.rotation();
    }

    /// Counts a reset of the state to a sensor that had been locked out.
    pub(super) fn finish_reset(&mut self, sensor: Sensor) -> Fusion {
        self.status.resets = self.status.resets.wrapping_add(1);
        self.status.diverged |= self.gates.record_reset(sensor, self.now);
        Fusion::Reset
    }

    /// Inflates tilt and gyro bias because flow's innovations are biased. Counts as a reset: many in a row mean that
    /// the estimate has diverged.
    pub(super) fn inflate_on_innovation_bias(&mut self) {
        self.inflate_tilt();
        self.status.diverged |= self.gates.count_reset(self.now);
    }

    /// Inflates the tilt and the gyro bias that may have tilted it.
    pub(super) fn inflate_tilt(&mut self) {
        self.flow_monitor.inflated(TILT_INFLATION);
        for axis in 0..2 {
            self.covariance.inflate(ATTITUDE + axis, TILT_INFLATION * TILT_INFLATION);
            self.covariance.inflate(GYRO_BIAS + axis, GYRO_BIAS_INFLATION * GYRO_BIAS_INFLATION);
            // Tilt and accelerometer bias look alike to flow: the bias is estimated anew.
            self.reset_accel_bias(axis);
        }
    }

    /// The vehicle has turned by this angle, rad, faster than flow follows.
    pub(super) fn inflate_turned(&mut self, angle: f32) {
        let tilt = TURNED * angle;
        self.flow_monitor.inflated(tilt);
        for axis in 0..2 {
            self.covariance.inflate(ATTITUDE + axis, tilt * tilt);
        }
    }

    /// Undoes what flow did in the last `lied` seconds, because it lied.
    pub(super) fn undo_flow(&mut self, lied: f32) {
        let correction = self.flow_influence.undo(&self.state.rotation(), lied);
        self.state.correct(&correction);
        for axis in 0..2 {
            self.covariance.inflate(ATTITUDE + axis, LIE_TILT * LIE_TILT);
            self.covariance.inflate(GYRO_BIAS + axis, LIE_GYRO_BIAS * LIE_GYRO_BIAS);
            self.covariance.reset(VELOCITY + axis, LIE_VELOCITY * LIE_VELOCITY);
            self.reset_accel_bias(axis);
        }
        self.reset_history();
    }

    /// Takes a jump that was the gyro's own out of bias, attitude and velocity.
    // Hardly ever.
    #[inline(never)]
    pub(super) fn correct_gyro(&mut self, jump: &GyroJump) {
        let turned = jump.rate.map(|rate| rate * jump.age);
        let mut correction = [0.0; N];
        for axis in 0..2 {
            correction[GYRO_BIAS + axis] = jump.rate[axis];
            correction[ATTITUDE + axis] = -turned[axis];
            let [rate, turn] = [jump.rate[axis], turned[axis]].map(|value| JUMP_UNCERTAIN * value);
            self.covariance.inflate(GYRO_BIAS + axis, rate * rate);
            self.covariance.inflate(ATTITUDE + axis, turn * turn);
            self.covariance.inflate(VELOCITY + axis, JUMP_VELOCITY * JUMP_VELOCITY);
            // Here the filter starts again, and what turned on the ground is taken to be the gyro's.
            self.calibration.gyro_bias[axis] += jump.rate[axis];
        }
        self.state.correct(&correction);
        self.state.velocity.x = jump.velocity.x;
        self.state.velocity.y = jump.velocity.y;
        self.flow_monitor.gyro_jumped();
        // What is left of the jump turns the tilt until flow has corrected it.
        let [x, y] = jump.rate;
        self.flow_monitor.inflated(JUMP_UNCERTAIN * SETTLES * math::sqrt(x * x + y * y));
        self.reset_history();
        self.status.resets = self.status.resets.wrapping_add(1);
    }

    /// Takes a shift of the gyro's zero on the ground out of its bias. What it did to the attitude went into the accelerometer's bias as
    /// well, so both are as after power-on: gravity is the vertical.
    pub(super) fn correct_standing_gyro(&mut self, shift: &StandingShift) {
        for axis in 0..2 {
            self.state.gyro_bias[axis] += shift.rate[axis];
            self.calibration.gyro_bias[axis] += shift.rate[axis];
            self.covariance.inflate(GYRO_BIAS + axis, STANDING_SHIFT * STANDING_SHIFT);
            self.covariance.inflate(ATTITUDE + axis, LIE_TILT * LIE_TILT);
            self.reset_accel_bias(axis);
        }
        let up = rotate_back(&self.state.rotation(), &Vec3::new(0.0, 0.0, -1.0));
        let tilt = shift.accel.cross(&up) / shift.accel.norm().max(1.0);
        let mut correction = [0.0; N];
        correction[ATTITUDE..ATTITUDE + 2].copy_from_slice(&[tilt.x, tilt.y]);
        self.state.correct(&correction);
        self.reset_history();
        self.status.resets = self.status.resets.wrapping_add(1);
    }

    /// Takes a shift of the gyro's zero out of bias, attitude and velocity. `measured`: flow's velocity, world.
    pub(super) fn correct_gyro_shift(&mut self, shift: &GyroShift, measured: &Vec3, distance: f32) {
        let rotation = self.state.rotation();
        let [bias, tilt] = [shift.bias, shift.tilt].map(|[x, y]| rotate_back(&rotation, &Vec3::new(x, y, 0.0)));
        let mut correction = [0.0; N];
        for axis in 0..2 {
            correction[GYRO_BIAS + axis] = bias[axis];
            correction[ATTITUDE + axis] = tilt[axis];
            self.covariance.inflate(ATTITUDE + axis, SHIFT_TILT * SHIFT_TILT);
            self.covariance.inflate(GYRO_BIAS + axis, SHIFT_GYRO_BIAS * SHIFT_GYRO_BIAS);
            self.covariance.inflate(VELOCITY + axis, JUMP_VELOCITY * JUMP_VELOCITY);
            // Here the filter starts again, and what turned on the ground is taken to be the gyro's.
            self.calibration.gyro_bias[axis] += bias[axis];
        }
        self.state.correct(&correction);
        // The rotation that flow was compensated for is the raw one.
        let bias = rotate(&self.state.rotation(), &self.state.gyro_bias);
        self.state.velocity.x = measured.x + distance * bias.y;
        self.state.velocity.y = measured.y - distance * bias.x;
        self.flow_influence = Influence::default();
        self.flow_monitor.start_over();
        self.flow_monitor.inflated(SHIFT_TILT);
        self.reset_history();
        self.status.resets = self.status.resets.wrapping_add(1);
    }

    /// Turns the world about its vertical, in which the heading had not been known, by `turn`, rad. The heading has the standard deviation
    /// `sigma` then, and the tilt that of a vehicle that has moved without any measurement of it.
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
        for (axis, part) in vertical.iter().enumerate() {
            self.covariance.inflate(ATTITUDE + axis, part * part * sigma * sigma + ALIGNED_TILT * ALIGNED_TILT);
        }
        self.alignment.found();
    }

    /// Starts position and velocity again, in flight. Attitude, heading and biases are better than those of the
    /// calibration at power-on, so they stay; their variance grows by what drove the estimate away.
    pub(super) fn restart_motion(&mut self) {
        let mut variances = initial_covariance(&self.config);
        for axis in 0..3 {
            for (block, limit) in [(ATTITUDE, 1.0), (GYRO_BIAS, 0.1), (ACCEL_BIAS, 2.0)] {
                // A covariance that is not sound says nothing.
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
        // Where that is, is a matter of definition; a jump would be flown back.
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
        self.flow_monitor = FlowMonitor::airborne();
        self.vertical.restart(-self.state.accel_bias.z);
        self.reset_history();
        self.status.diverged = false;
    }

    /// Starts again: on the ground, or where the attitude is no number, from the last calibration; in flight position and
    /// velocity only.
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

    /// Restarts a filter that is not finite or whose covariance is not sound; a position or velocity beyond any flight
    /// means divergence. Where nothing measures the horizontal position it is nobody's claim. Nor are, of a vehicle that is not
    /// told to fly, a horizontal velocity that nothing measures and a height that nothing has ever measured.
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

    /// Is the vertical position more than the sum of what the inertial sensor felt?
    fn claims_height(&self) -> bool {
        let measured = self.surface.is_some() || self.baro_offset.is_some() || self.is_aided_outside(Sensor::Down);
        self.command.flying || measured
    }

    /// Asks the second opinion about the range. Where it contradicts, height, climb rate and bias are its.
    // As the pseudo-measurements, not in every step.
    #[inline(never)]
    pub(super) fn judge_range(&mut self) {
        if let Some(Correction { climb, bias, higher }) = self.vertical.judge(self.now, self.height()) {
            self.state.velocity.z = -climb;
            self.state.position.z -= higher;
            self.state.accel_bias.z = -bias;
            self.covariance.reset(VELOCITY + 2, 0.5);
            self.covariance.inflate(POSITION + 2, 0.1);
            self.covariance.reset(ACCEL_BIAS + 2, 0.1);
            // The barometer holds the height from here.
            self.baro_offset = None;
            self.status.resets = self.status.resets.wrapping_add(1);
        }
        self.status.range_implausible = self.vertical.is_implausible();
    }
}
