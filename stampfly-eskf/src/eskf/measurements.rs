//! Updates with on-board sensors: range, flow, barometer, magnetometer.
//!
//! Each one refuses unusable samples, aligns in time, computes the innovation, tests the gate, and
//! then fuses, rejects, or resets after a lock-out. Models and conditions are in
//! [`aid`](crate::aid).

use super::fast_turn::Turn;
use super::gate::{GateResult, Sensor};
use super::range_gate::Use;
use super::wander::limited;
use super::*;
use crate::config::MagModel;

/// Largest residual for a reset of the height to the barometer where no other sensor measures it,
/// m. Beyond it one of the two is wrong and it is unknown which: height and climb rate become
/// invalid.
const BARO_REACH: f32 = 2.0;
/// Upper bound on the barometer interval used for the bias walk, s. A longer silence is not all due
/// to thrust changes.
const LONGEST_BARO: f32 = 0.5;
/// After this time without an external height the barometer holds the height.
const FIX_SILENT: Duration = Duration::from_secs(2);
/// After this time without ranges (six readings) the range no longer observes the accelerometer's
/// vertical bias.
const RANGE_SILENT: Duration = Duration::from_millis(200);
/// Height variance, m², above which the first barometer offset inherits the uncertainty of the
/// height, as after the first fix of a receiver.
const VAGUE_HEIGHT: f32 = 1.0;
/// Test ratio assigned to a range that [`range_gate`](super::range_gate) rejects.
const REJECTED: f32 = 2.0;
/// Largest climb-rate error assumed to have built up within the lock-out, m/s: 7.5 m/s² for 0.2 s,
/// more than vibration shifts an accelerometer's zero.
const WRONG_CLIMB: f32 = 1.5;
/// Largest image motion in one reading, rad: 100 rad/s over the longest interval, more than any
/// gyro measures.
const LARGEST_FLOW: f32 = 10.0;
/// Largest standard deviation of the height for flow: `KNOWN_DISTANCE`, m, plus `KNOWN_SHARE` of
/// the distance. Flow times distance is the velocity, so with a larger error the velocity may be
/// half or twice the true one.
const KNOWN_DISTANCE: f32 = 0.1;
const KNOWN_SHARE: f32 = 0.5;

/// Shortest distance at which flow is used for a vehicle moved by hand, m; it moves slowly enough
/// for the camera.
const NEAREST: f32 = 0.02;
/// States that flow in flight considers but does not correct: height, climb rate and vertical
/// accelerometer bias. A tilted camera measures a part of the climb. At the start of a take-off or
/// after a reset the climb rate is so uncertain that a wrong distance, or a slipping leg, would be
/// taken for climb. Their uncertainty stays in the innovation variance. A vehicle in a hand has no
/// vibration, and there flow's information on the climb is used.
const VERTICAL: [usize; 3] = [POSITION + 2, VELOCITY + 2, ACCEL_BIAS + 2];

impl Eskf {
    pub(super) fn update_tof(&mut self, at: Instant, tof: &TofData) -> Result<Fusion, Refusal> {
        let age = self.admit(Sensor::Tof, at, &[tof.distance])?;
        let Some(delayed) = &self.state_at(age) else { return Err(Refusal::Stale) };
        if !tof.valid {
            return Err(Refusal::Quality);
        }
        if !(self.config.tof_min..=self.config.tof_max).contains(&tof.distance) {
            return Err(Refusal::Range);
        }
        let cos_tilt = delayed.rotation[2][2];
        if cos_tilt < self.config.min_cos_tilt {
            return Err(Refusal::Tilt);
        }
        let below = tof.distance * cos_tilt;
        let expected = self.surface.map_or(tof.distance, |surface| (surface - delayed.state.position.z) / cos_tilt);
        if self.anchor.is_none() && self.range_gate.is_window(tof.distance, expected) {
            return Err(Refusal::Range);
        }
        // Counted before the gate: a monitor looks at every range that was comparable.
        if let Some(tested) = self.status.tested.get_mut(Counter::Tof as usize) {
            *tested = tested.wrapping_add(1);
        }
        if let Some(anchor) = self.anchor {
            // Stationary: the height is known, so the range measures the surface below the sensor.
            let measured = anchor.z + below;
            self.surface = Some(self.surface.map_or(measured, |surface| surface + 0.1 * (measured - surface)));
            self.range_gate.stand(tof.distance);
            self.gates.accept(Sensor::Tof, self.now);
            return Ok(Fusion::Fused { ratio: 0.0 });
        }
        let (climb_sigma, rejecting) = (self.sigma(VELOCITY + 2), self.gates.is_rejected(Sensor::Tof));
        let use_as = self.range_gate.step(self.now, tof.distance, expected, climb_sigma, rejecting);
        if use_as == Use::Ignore || self.findings.range.is_left_out() {
            return Err(Refusal::Implausible);
        }
        self.range_used = self.now;
        // The first range in flight defines the surface instead of correcting the height.
        let surface = *self.surface.get_or_insert(delayed.state.position.z + below);
        let row = aid::tof::range(&delayed.state, &delayed.rotation, surface);
        // The beam is a cone and reports the nearest surface in it: on a tilted body anything
        // between the range along the axis and the vertical distance.
        let cone = tof.distance * (1.0 - cos_tilt);
        let sigma = math::larger(self.config.tof_sigma, tof.sigma) + cone;
        let variance = sigma * sigma;
        let innovation = self.innovation(delayed, [row], [tof.distance], [variance]);
        let ratio = self.test_ratio(&innovation);
        self.status.tof_innovation = tof.distance - row.predicted;
        self.status.tof_ratio = ratio;
        let gated = if use_as == Use::Reject { ratio.max(REJECTED) } else { ratio };
        match self.test(Sensor::Tof, gated) {
            GateResult::Fuse => Ok(self.update(&innovation, ratio)),
            GateResult::Reject => Ok(Fusion::Gated { ratio }),
            GateResult::Reset => {
                let down = surface - below - delayed.state.position.z;
                if self.range_gate.rejects_since_jump() {
                    // A vehicle cannot move so far between two readings: the surface has changed.
                    self.surface = Some(surface - down);
                    return Ok(self.finish_reset(Sensor::Tof));
                }
                self.state.position.z += down;
                // Twice the standard deviation, because the height rests on this single sample.
                self.covariance.reset(POSITION + 2, 4.0 * variance);
                // The height error came from a climb-rate error, and that from an acceleration
                // error during the lock-out. Open both, so that the next ranges estimate them.
                let time = self.config.lockout;
                let climb = (2.0 * down / time).clamp(-WRONG_CLIMB, WRONG_CLIMB);
                self.covariance.reset(VELOCITY + 2, 1.0 + climb * climb);
                self.covariance.inflate(ACCEL_BIAS + 2, 0.04 + climb * climb / (time * time));
                Ok(self.finish_reset(Sensor::Tof))
            }
        }
    }

    pub(super) fn update_flow(&mut self, at: Instant, flow: &FlowData) -> Result<Fusion, Refusal> {
        if !flow.valid || flow.quality < self.config.flow_min_quality {
            return Err(Refusal::Quality);
        }
        if !(1e-3..=0.1).contains(&flow.interval) || flow.delta_x.abs() + flow.delta_y.abs() > LARGEST_FLOW {
            return Err(Refusal::Range);
        }
        // The reading is the mean velocity over the interval: compare it with the state at its
        // middle.
        let late = self.config.flow_delay + 0.5 * flow.interval;
        let middle = at - Duration::from_micros((late * 1e6) as u64);
        let age = self.admit(Sensor::Flow, middle, &[flow.delta_x, flow.delta_y])?;
        let Some(delayed) = &self.state_at(age) else { return Err(Refusal::Stale) };
        if delayed.rotation[2][2] < self.config.min_cos_tilt {
            return Err(Refusal::Tilt);
        }
        let surface = self.surface.ok_or(Refusal::Missing)?;
        let distance = (surface - delayed.state.position.z) / delayed.rotation[2][2];
        // During a take-off a leg may slip while the image is blurred. After readings from a sharp
        // distance the velocity is certain enough for the last centimetres of a landing and for
        // flight over a table.
        self.has_seen_floor = self.command.flying && (self.has_seen_floor || distance >= self.config.flow_min_distance);
        let takes_off = self.command.flying && !self.has_seen_floor;
        if distance < if takes_off { self.config.flow_min_distance } else { NEAREST } {
            return Err(Refusal::Range);
        }
        let uncertain = KNOWN_DISTANCE + KNOWN_SHARE * distance;
        if self.covariance.get(POSITION + 2, POSITION + 2) > uncertain * uncertain {
            return Err(Refusal::Missing);
        }
        // The interval ends half its length after its middle.
        let end = delayed.age - 0.5 * flow.interval;
        let turning = self.history.mean_rate(end, flow.interval).unwrap_or(self.rate);
        let raw = turning + self.state.gyro_bias;
        let rate = [flow.delta_x / flow.interval, flow.delta_y / flow.interval];
        let measured = aid::flow::measured_velocity(rate, [raw.x, raw.y], distance);
        let rows = aid::flow::body_velocity(&delayed.state, &delayed.rotation, distance);
        // Not `map`: it would compile to a call.
        let [x, y] = rows;
        let rows = [without_heading(x, &delayed.rotation[2]), without_heading(y, &delayed.rotation[2])];
        // The proportional part of the error must be computed from the prediction. Computed from
        // the reading it gives large readings too little weight, and the velocity becomes too
        // small.
        let variance = |row: &Row, turning: f32| {
            let base = self.config.flow_sigma * distance;
            let scale = self.config.flow_scale_sigma * (row.predicted + turning * distance);
            base * base + scale * scale
        };
        let variances = [variance(&rows[0], raw.y), variance(&rows[1], -raw.x)];
        // One gate for both axes: with separate gates a single axis could be locked out and drift
        // unnoticed.
        let innovation = self.innovation(delayed, rows, measured, variances);
        let ratio = self.test_ratio(&innovation);
        self.status.flow_innovation = [measured[0] - rows[0].predicted, measured[1] - rows[1].predicted];
        self.status.flow_ratio = ratio;
        // Flow measures two body axes. Along the beam, take the estimated velocity.
        let along = rotate_back(&delayed.rotation, &delayed.state.velocity).z;
        let world = rotate(&delayed.rotation, &Vec3::new(measured[0], measured[1], along));
        if self.anchor.is_none() {
            let fastest = self.config.flow_max_rate;
            // Bias-free rates: a gyro bias does not move the image.
            match self.fast_turn.step([turning.x, turning.y], flow.interval, fastest) {
                Turn::Slow => {}
                Turn::Fast => return Err(Refusal::Range),
                Turn::Over(angle) => {
                    // The inflation takes effect with the next reading.
                    self.inflate_turned(angle);
                    return Err(Refusal::Range);
                }
            }
            let length = |[x, y]: [f32; 2]| math::sqrt(x * x + y * y);
            let picture = length([rows[0].predicted / distance + raw.y, rows[1].predicted / distance - raw.x]);
            // Both the reading and the prediction count, because a reading beyond the limit
            // aliases. A larger contradiction is left to the gate.
            let [slower, faster] = [math::smaller(length(rate), picture), math::larger(length(rate), picture)];
            if self.command.flying && faster > fastest && slower > 0.5 * fastest {
                return Err(Refusal::Range);
            }
        }
        if let Some(tested) = self.status.tested.get_mut(Counter::Flow as usize) {
            *tested = tested.wrapping_add(1);
        }
        if self.findings.flow.is_left_out() {
            return Err(Refusal::Implausible);
        }
        self.acceleration.update(middle, world);
        match self.test(Sensor::Flow, ratio) {
            GateResult::Fuse => {
                let Some(mut correction) = self.covariance.try_update(&innovation) else {
                    return Err(Refusal::Implausible);
                };
                if self.command.flying {
                    self.covariance.consider(&innovation, VERTICAL, &mut correction);
                }
                self.state.correct(&correction);
                // On the ground the zero-velocity update holds the velocity, so a bias of the
                // innovations has no meaning.
                if self.anchor.is_none() && self.flow_innovation_bias.update(innovation.whitened(), flow.interval) {
                    self.inflate_on_innovation_bias();
                }
                Ok(Fusion::Fused { ratio })
            }
            GateResult::Reject => Ok(Fusion::Gated { ratio }),
            GateResult::Reset => {
                let mut correction = [0.0; N];
                correction[VELOCITY] = world.x - delayed.state.velocity.x;
                correction[VELOCITY + 1] = world.y - delayed.state.velocity.y;
                self.state.correct(&correction);
                for (axis, variance) in variances.into_iter().enumerate() {
                    self.covariance.reset(VELOCITY + axis, 4.0 * variance + 0.01);
                }
                // The velocity error came from an error of tilt or bias.
                self.inflate_tilt();
                Ok(self.finish_reset(Sensor::Flow))
            }
        }
    }

    pub(super) fn update_baro(&mut self, at: Instant, baro: &BaroData) -> Result<Fusion, Refusal> {
        if !self.config.baro_enable {
            return Err(Refusal::NotUsed);
        }
        let age = self.admit(Sensor::Baro, at, &[baro.altitude])?;
        let Some(delayed) = &self.state_at(age) else { return Err(Refusal::Stale) };
        if self.is_nowhere(2) {
            // The altitude has no reference before the first fix.
            return Err(Refusal::Missing);
        }
        if self.command.flying && self.anchor.is_none() && self.now.since(self.range_used) > RANGE_SILENT {
            // Only a range observes how the accelerometer's bias moves with the thrust. Without
            // ranges let it walk.
            let walk = self.config.thrust_bias_walk;
            let time = self.now.since(self.baro_updated).seconds().min(LONGEST_BARO);
            self.covariance.inflate(ACCEL_BIAS + 2, walk * walk * time);
        }
        let wash = if self.anchor.is_some() { 0.0 } else { aid::baro::wash(self.config.baro_wash, self.height()) };
        let noise = self.config.baro_sigma * self.config.baro_sigma + wash * wash;
        let here = baro.altitude + delayed.state.position.z;
        let since = core::mem::replace(&mut self.baro_updated, self.now);
        let height = self.covariance.get(POSITION + 2, POSITION + 2);
        let offset = self
            .baro_offset
            .get_or_insert_with(|| Offset::new(here, if height > VAGUE_HEIGHT { noise + height } else { noise }));
        offset.propagate(self.now.since(since).seconds(), self.config.baro_walk);
        let offset = *offset;
        let row = aid::baro::altitude(&delayed.state, offset.value());
        let residual = baro.altitude - row.predicted;
        let backup = self.config.baro_backup && self.gates.is_recent_within(Sensor::Down, self.now, FIX_SILENT);
        let variance = noise + offset.variance();
        let innovation = self.innovation(delayed, [row], [baro.altitude], [variance]);
        let ratio = self.test_ratio(&innovation);
        self.status.baro_innovation = residual;
        self.status.baro_ratio = ratio;
        match self.test(Sensor::Baro, ratio) {
            GateResult::Fuse => {
                // With `baro_backup`, once the receiver is silent the learnt offset holds the
                // height and must not follow it.
                if let Some(offset) = self.baro_offset.as_mut().filter(|_| backup || !self.config.baro_backup) {
                    offset.update(residual, noise + height);
                    if backup {
                        // The error of the height is common to all differences: the offset is at
                        // most as certain as the height.
                        offset.inflate((height - offset.variance()).max(0.0));
                    }
                }
                if backup {
                    return Ok(Fusion::Fused { ratio });
                }
                let innovation = if self.config.baro_backup {
                    // However many altitudes are fused, the height is not more certain than the
                    // offset.
                    let variance = limited(height, variance, offset.variance());
                    self.innovation(delayed, [row], [baro.altitude], [variance])
                } else {
                    innovation
                };
                Ok(self.update(&innovation, ratio))
            }
            GateResult::Reject => Ok(Fusion::Gated { ratio }),
            GateResult::Reset => {
                if backup || self.is_range_aided() || self.anchor.is_some() {
                    // A jump of the air pressure does not move the vehicle: reset the offset. That
                    // is neither a sign of divergence nor aiding.
                    self.baro_offset = Some(Offset::new(here, noise));
                    self.gates.restart_lockout(Sensor::Baro, self.now);
                    self.status.resets = self.status.resets.wrapping_add(1);
                    return Ok(Fusion::Reset);
                }
                if residual.abs() > BARO_REACH {
                    return Ok(Fusion::Gated { ratio });
                }
                // No other sensor holds the height: the filter has diverged from it.
                self.state.position.z -= residual;
                self.covariance.reset(POSITION + 2, 4.0 * noise);
                self.covariance.reset(VELOCITY + 2, 1.0);
                self.covariance.inflate(ACCEL_BIAS + 2, 0.04);
                Ok(self.finish_reset(Sensor::Baro))
            }
        }
    }

    pub(super) fn update_mag(&mut self, at: Instant, mag: &MagData) -> Result<Fusion, Refusal> {
        if !self.config.mag_enable {
            return Err(Refusal::NotUsed);
        }
        let age = self.admit(Sensor::Mag, at, &mag.field.to_array())?;
        let Some(delayed) = &self.state_at(age) else { return Err(Refusal::Stale) };
        let strength = mag.field.norm();
        if !(10.0..=100.0).contains(&strength) {
            return Err(Refusal::Range);
        }
        let reference = self.field.ok_or(Refusal::Missing)?;
        let variance = self.config.mag_sigma * self.config.mag_sigma;
        let heading = math::atan2(reference.y, reference.x);
        let row = aid::heading::error(&delayed.rotation, &mag.field, heading).ok_or(Refusal::Range)?;
        self.status.mag_innovation = -row.predicted;
        match self.config.mag_model {
            MagModel::Heading => {
                let innovation = self.innovation(delayed, [row], [0.0], [variance]);
                let ratio = self.test_ratio(&innovation);
                Ok(self.gate_mag(&innovation, ratio))
            }
            MagModel::Field => {
                let rows = aid::field::direction(&delayed.rotation, &reference);
                let direction = mag.field / strength;
                let measured = [direction.x, direction.y, direction.z];
                let innovation = self.innovation(delayed, rows, measured, [variance; 3]);
                let ratio = self.test_ratio(&innovation);
                Ok(self.gate_mag(&innovation, ratio))
            }
        }
    }

    fn gate_mag<const M: usize>(&mut self, innovation: &Innovation<M>, ratio: f32) -> Fusion {
        self.status.mag_ratio = ratio;
        let verdict = self.test(Sensor::Mag, ratio);
        if verdict == GateResult::Fuse {
            return self.update(innovation, ratio);
        }
        if verdict == GateResult::Reset {
            // No other sensor corrects the heading. Inflate it, once per lock-out, until the field
            // passes the gate.
            self.gates.restart_lockout(Sensor::Mag, self.now);
            let vertical = self.state.rotation()[2];
            for (axis, part) in vertical.iter().enumerate() {
                self.covariance.inflate(ATTITUDE + axis, 0.1 * part * part);
            }
        }
        Fusion::Gated { ratio }
    }
}

/// A flow row without information on the heading: the component of its attitude columns along the
/// vertical (in body axes) is removed. In theory flow observes the heading while the vehicle
/// accelerates. In practice one degree of mounting error and the beat of frames and reads turn the
/// heading by degrees a minute, while a calibrated gyro alone keeps it within one.
#[inline(always)]
fn without_heading(mut row: Row, vertical: &[f32; 3]) -> Row {
    let [.., x, y, z, _, _, _, _, _, _] = &mut row.jacobian;
    let along = *x * vertical[0] + *y * vertical[1] + *z * vertical[2];
    *x -= along * vertical[0];
    *y -= along * vertical[1];
    *z -= along * vertical[2];
    row
}
