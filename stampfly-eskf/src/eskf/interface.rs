//! [`Estimator`] of the filter: initialise, command, predict, estimate.

use super::gate::Sensor;
use super::unfelt::{UNFELT_NOISE, unfelt};
use super::*;
use crate::aid::airspeed::Wind;

/// Largest specific force, m/s², or rate, rad/s, accepted: a thousand g is beyond any inertial
/// sensor. Squares of much larger values overflow and make the covariance NaN.
const LARGEST: f32 = 1.0e4;

/// Standard deviation, rad, from which a heading counts as unknown. A uniform distribution has
/// π/√3.
const UNKNOWN_HEADING: f32 = 1.5;
/// Largest standard deviation of a valid heading, rad: 20°.
const CERTAIN_HEADING: f32 = 0.35;

impl Estimator for Eskf {
    fn initialize(&mut self, at: Instant, calibration: &CalibrationResult) {
        let is_usable = |v: &Vec3| v.norm_squared() < LARGEST * LARGEST;
        if !is_usable(&calibration.gyro_bias) || !is_usable(&calibration.specific_force) {
            return;
        }
        // `Self::new` is inlined and writes in place: a second estimator would not fit on the
        // stack, and assigning single fields could miss one.
        let (command, findings, tallies) = (self.command, self.findings, self.tallies);
        *self = Self::new(self.config);
        self.now = at;
        self.initialized = true;
        self.calibration = *calibration;
        // The command and the findings describe the vehicle, not the estimate: they survive a
        // restart.
        (self.command, self.findings) = (command, findings);
        self.tallies = tallies;
        self.state.gyro_bias = calibration.gyro_bias;
        self.state.attitude = attitude_from_specific_force(&calibration.specific_force);
        self.pending_rotation = self.state.rotation();
        self.baro_updated = at;
        self.field =
            (calibration.field.norm() > 1.0).then(|| rotate(&self.pending_rotation, &calibration.field.normalize()));
        self.anchor = self.command.on_ground.then(Vec3::zeros);
        match self.start_heading() {
            None => self.constrain_heading(),
            Some((heading, sigma)) => self.set_start_heading(heading, sigma),
        }
    }

    fn command(&mut self, at: Instant, command: &EstimatorCommand) {
        let previous = core::mem::replace(&mut self.command, *command);
        if command.full_resets != previous.full_resets && self.initialized {
            // In flight, attitude and biases are better than those of the calibration.
            if command.on_ground || self.anchor.is_some() {
                let calibration = self.calibration;
                self.initialize(at, &calibration);
            } else {
                self.restart_motion();
            }
        }
        if command.origin_resets != previous.origin_resets {
            self.surface = self.surface.map(|surface| surface - self.state.position.z);
            if let Some(offset) = &mut self.baro_offset {
                offset.shift(self.state.position.z);
            }
            self.state.position = Vec3::zeros();
            self.state.velocity = Vec3::zeros();
            // The new origin is known exactly by definition.
            for axis in 0..3 {
                self.covariance.reset(POSITION + axis, self.config.initial_position * self.config.initial_position);
                self.covariance.reset(VELOCITY + axis, self.config.initial_velocity * self.config.initial_velocity);
            }
            self.anchor = None;
        }
        if command.accel_faulty && !previous.accel_faulty {
            self.begin_unfelt();
        }
        match (command.on_ground, self.anchor) {
            (true, None) => self.anchor = Some(self.state.position),
            (false, Some(anchor)) => {
                // The range sensor may have had no reading on the ground: the surface is then one
                // clearance below.
                self.surface.get_or_insert(anchor.z + self.config.ground_clearance);
                self.anchor = None;
                self.stood = Some(self.now);
                let vibration = self.config.vibration_bias;
                // The starting propellers shake the accelerometer and change the air pressure.
                self.covariance.inflate(ACCEL_BIAS + 2, vibration * vibration);
                if let Some(offset) = &mut self.baro_offset {
                    offset.inflate(self.config.baro_wash * self.config.baro_wash);
                }
            }
            _ => {}
        }
    }

    // Not inlined: in the loop over the samples the compiler would compute seventy addresses in
    // advance, 140 instructions.
    #[inline(never)]
    fn predict(&mut self, at: Instant, imu: &ImuData) {
        // Written so that NaN is refused, too.
        let usable = imu.accel.norm_squared() < LARGEST * LARGEST && imu.gyro.norm_squared() < LARGEST * LARGEST;
        let dt = at.since(self.now).seconds();
        if !usable {
            self.status.imu_refused = self.status.imu_refused.wrapping_add(1);
        }
        if !self.initialized || !usable || dt <= 0.0 {
            return;
        }
        let bridged = self.bridge.step(&self.config, at, imu);
        if bridged.is_some() {
            self.status.imu_refused = self.status.imu_refused.wrapping_add(1);
        }
        let mut imu = bridged.unwrap_or(*imu);
        if self.command.accel_faulty {
            imu.accel = unfelt();
        }
        let imu = &imu;
        self.now = at;
        // The motion during a gap is unknown, so late measurements cannot be placed before it.
        if dt > MAX_STEP {
            self.reset_history();
        }
        let motion = self.state.propagate(&imu.accel, &imu.gyro, math::smaller(dt, MAX_STEP));
        self.history.add(&motion);
        let [force, rate] = &mut self.vibration;
        force.add(&imu.accel, motion.dt);
        rate.add(&imu.gyro, motion.dt);
        self.pending_step.extend(&motion);
        let due = self.pending_step.duration > COVARIANCE_STEP;
        if due {
            let [force, rate] = &self.vibration;
            // Mean square times the sample interval is a noise density.
            let [force, rate] = [force.mean_square() * motion.dt, rate.mean_square() * motion.dt];
            let unfelt = if self.command.accel_faulty { UNFELT_NOISE * UNFELT_NOISE } else { 0.0 };
            let noise = ProcessNoise {
                velocity: self.noise.velocity + self.config.accel_vibration * force + unfelt,
                attitude: self.noise.attitude + self.config.gyro_vibration * rate,
                ..self.noise
            };
            self.covariance.propagate(&self.pending_rotation, &self.pending_step, &noise);
            self.limit_attitude();
            self.publish_sigmas();
            self.pending_step = PropagationStep::default();
            self.pending_rotation = self.state.rotation();
        }
        self.rate = motion.rate;
        self.force = motion.force;
        self.accels.add(&imu.accel);
        self.steps = self.steps.wrapping_add(1);
        // Half-way between two gravity updates, so that no step does both.
        if let Some(anchor) = self.anchor
            && self.steps % PSEUDO_MEASUREMENT_DIVIDER == PSEUDO_MEASUREMENT_DIVIDER / 2
        {
            self.constrain_stationary(anchor);
        }
        if self.steps.is_multiple_of(PSEUDO_MEASUREMENT_DIVIDER)
            && let Some((accel, _)) = self.accels.take()
        {
            self.apply_pseudo_measurements(accel, dt * PSEUDO_MEASUREMENT_DIVIDER as f32);
        }
        if self.config.gravity_use == GravityUse::Always && self.anchor.is_none() && !self.command.accel_faulty {
            self.felt.add(&imu.accel);
            // One update with the mean has the information of the single samples at a fraction of
            // the cost.
            if due && let Some((accel, count)) = self.felt.take() {
                let sigma = self.config.gravity_sigma / math::sqrt(count);
                self.update_gravity(accel, &self.acceleration.at(at), sigma);
            }
        }
        self.check_health();
    }

    #[inline(never)]
    fn fuse_tof(&mut self, at: Instant, tof: &TofData) -> Fusion {
        let fusion = self.update_tof(at, tof).unwrap_or_else(Fusion::Refused);
        self.count(Counter::Tof, fusion)
    }

    #[inline(never)]
    fn fuse_flow(&mut self, at: Instant, flow: &FlowData) -> Fusion {
        let fusion = self.update_flow(at, flow).unwrap_or_else(Fusion::Refused);
        self.count(Counter::Flow, fusion)
    }

    #[inline(never)]
    fn fuse_baro(&mut self, at: Instant, baro: &BaroData) -> Fusion {
        let fusion = self.update_baro(at, baro).unwrap_or_else(Fusion::Refused);
        self.count(Counter::Baro, fusion)
    }

    #[inline(never)]
    fn fuse_mag(&mut self, at: Instant, mag: &MagData) -> Fusion {
        let fusion = self.update_mag(at, mag).unwrap_or_else(Fusion::Refused);
        self.count(Counter::Mag, fusion)
    }

    fn fuse_velocity(&mut self, at: Instant, velocity: &Vec3, sigma: &Vec3) -> Fusion {
        let fusion = self.update_velocity(at, velocity, sigma).unwrap_or_else(Fusion::Refused);
        self.tallied(Aiding::Velocity, fusion)
    }

    /// While an external velocity is younger than two seconds, an airspeed only updates the wind.
    /// Afterwards it corrects the velocity and keeps the outputs valid, no more certain than the
    /// wind. Counted as [`Aiding::Own`].
    ///
    /// ```
    /// use stampfly_eskf::{Eskf, EskfConfig, Estimator, Fusion, Refusal, aid::airspeed::Wind};
    /// use stampfly_types::Instant;
    /// let (mut eskf, mut wind) = (Eskf::new(EskfConfig::outdoors()), Wind::default());
    /// let fusion = eskf.fuse_airspeed(Instant::ZERO, 15.0, 0.5, &mut wind);
    /// assert_eq!(fusion, Fusion::Refused(Refusal::NotInitialized));
    /// ```
    ///
    /// Refused before initialisation, while the heading is unknown, for a steep nose, and for
    /// samples that are too old or not finite.
    fn fuse_airspeed(&mut self, at: Instant, speed: f32, sigma: f32, wind: &mut Wind) -> Fusion {
        let fusion = self.update_airspeed(at, speed, sigma, wind).unwrap_or_else(Fusion::Refused);
        self.tallied(Aiding::Own, fusion)
    }

    fn fuse_position(&mut self, at: Instant, position: &Vec3, sigma: &Vec3) -> Fusion {
        let fusion = self.update_position(at, position, sigma).unwrap_or_else(Fusion::Refused);
        self.tallied(Aiding::Position, fusion)
    }

    fn fuse_attitude(&mut self, at: Instant, attitude: &Quat, sigma: f32) -> Fusion {
        let fusion = self.update_attitude(at, attitude, sigma).unwrap_or_else(Fusion::Refused);
        self.tallied(Aiding::Attitude, fusion)
    }

    fn estimate(&self) -> StateEstimate {
        let recent = |sensor| self.gates.is_recent(sensor, self.now);
        let stationary = self.anchor.is_some();
        let sound = self.initialized && !self.status.diverged;
        let down = self.is_aided_outside(Sensor::Down);
        let [range, air] = [self.is_range_aided(), recent(Sensor::Baro)];
        // `EXTERNAL` excludes aiding from on board: an airspeed, a model of wheels.
        let outside = [Sensor::Position, Sensor::Velocity, Sensor::Attitude].into_iter().any(recent);
        let north = self.is_north_known();
        let horizontal = sound && north && (self.is_velocity_aided() || self.has_just_risen());
        let drifts = horizontal || (sound && self.feels_drag() && self.is_velocity_certain() && self.height() > LEVEL);
        let baro = air && !self.findings.baro.is_left_out();
        let vertical = sound && (range || baro || down || stationary);
        let valid = Validity::NONE
            .set(Validity::TILT, self.initialized)
            .set(Validity::HEADING, self.initialized && north && self.is_heading_certain())
            .set(Validity::VELOCITY_XY, drifts)
            .set(Validity::POSITION_XY, horizontal)
            .set(Validity::VELOCITY_Z | Validity::POSITION_Z, vertical)
            .set(Validity::HEIGHT, sound && self.surface.is_some() && vertical);
        let sensors = SensorMask::NONE
            .set(SensorMask::IMU, self.initialized)
            .set(SensorMask::TOF, range)
            .set(SensorMask::FLOW, recent(Sensor::Flow) && !self.findings.flow.is_left_out())
            .set(SensorMask::BARO, air)
            .set(SensorMask::MAG, recent(Sensor::Mag))
            .set(SensorMask::ACCEL_ATTITUDE, recent(Sensor::Gravity))
            .set(SensorMask::STATIONARY, stationary)
            .set(SensorMask::EXTERNAL, outside);
        let p = &self.covariance;
        StateEstimate {
            attitude: self.state.quat(),
            position: self.state.position,
            velocity: self.state.velocity,
            angular_rate: self.rate,
            specific_force: self.force,
            gyro_bias: self.state.gyro_bias,
            accel_bias: self.state.accel_bias,
            height: self.height(),
            position_std_xy: math::sqrt(p.get(POSITION, POSITION) + p.get(POSITION + 1, POSITION + 1)),
            valid,
            sensors,
        }
    }

    fn status(&self) -> EstimatorStatus {
        self.status
    }

    fn heed(&mut self, _at: Instant, findings: &SensorFindings) {
        self.findings = *findings;
    }

    fn correct(&mut self, _at: Instant, correction: &EstimateCorrection) {
        self.correct_by(correction);
    }
}

impl Eskf {
    /// Initial heading and its standard deviation, rad; `None` where the nose defines north. Also
    /// sets the reference field of the magnetometer.
    fn start_heading(&mut self) -> Option<(f32, f32)> {
        let seen = self.field;
        if self.config.start_heading != StartHeading::Nose {
            self.field = match (self.config.earth_field, seen) {
                // Magnetic north, with the inclination of the calibration.
                (None, Some(seen)) => Some(Vec3::new(math::sqrt(seen.x * seen.x + seen.y * seen.y), 0.0, seen.z)),
                (given, _) => given.filter(|field| field.norm() > 0.0).map(|field| field.normalize()),
            };
        }
        match self.config.start_heading {
            StartHeading::Nose => None,
            StartHeading::Given { heading, sigma } if heading.is_finite() && sigma.is_finite() => {
                Some((heading, sigma))
            }
            StartHeading::Magnetic if self.config.mag_enable => match (seen, self.field) {
                // The angle between the measured field and the earth's field is the heading.
                (Some(seen), Some(earth)) => {
                    let heading = math::atan2(earth.y, earth.x) - math::atan2(seen.y, seen.x);
                    Some((heading, self.config.mag_sigma))
                }
                _ => Some((0.0, UNKNOWN_HEADING)),
            },
            _ => Some((0.0, UNKNOWN_HEADING)),
        }
    }

    /// Rotates the attitude, whose heading is zero, to this heading, or starts the search for it.
    fn set_start_heading(&mut self, heading: f32, sigma: f32) {
        if sigma >= UNKNOWN_HEADING {
            self.alignment = Alignment::SOUGHT;
            return self.constrain_heading();
        }
        let (sin, cos) = math::sin_cos(0.5 * heading);
        self.state.attitude = multiply([cos, 0.0, 0.0, sin], self.state.attitude);
        self.pending_rotation = self.state.rotation();
        // The variance of a rotation about the vertical, distributed over the body axes.
        for (axis, part) in self.pending_rotation[2].into_iter().enumerate() {
            self.covariance.inflate(ATTITUDE + axis, part * part * sigma * sigma);
        }
    }

    /// Whether the heading is certain enough to be valid. With [`StartHeading::Nose`] it is exact
    /// by definition.
    fn is_heading_certain(&self) -> bool {
        if self.config.start_heading == StartHeading::Nose {
            return true;
        }
        let [x, y, z] = self.state.rotation()[2];
        let p = |i: usize, j: usize| self.covariance.get(ATTITUDE + i, ATTITUDE + j);
        let variance = x * x * p(0, 0)
            + y * y * p(1, 1)
            + z * z * p(2, 2)
            + 2.0 * (x * y * p(0, 1) + x * z * p(0, 2) + y * z * p(1, 2));
        variance < CERTAIN_HEADING * CERTAIN_HEADING
    }
}
