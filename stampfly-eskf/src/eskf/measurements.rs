//! One update a sensor: time alignment, innovation, gate, then update, rejection, or reset after a lock-out. The
//! models, and the conditions of each sensor, are in [`aid`](crate::aid).

use super::fast_turn::Turn;
use super::gate::{GateResult, Sensor};
use super::range_gate::Use;
use super::wander::limited;
use super::*;
use crate::config::MagModel;

/// Where nothing but the barometer holds the height, the height is reset to one that is this near, m. Farther away one of
/// them is wrong, and it is not known which: height and climb rate become invalid.
const BARO_REACH: f32 = 2.0;
/// A barometer that was silent for longer counts as silent for so long, s: what it says next is not all motion.
const LONGEST_BARO: f32 = 0.5;
/// A receiver that is silent for longer leaves the height to the barometer.
const FIX_SILENT: Duration = Duration::from_secs(2);
/// After a silence of six readings the range holds neither height nor climb rate.
const RANGE_SILENT: Duration = Duration::from_millis(200);
/// Variance of the height, m², beyond which the barometer's first offset is as uncertain as that height: after a receiver's first fix.
const VAGUE_HEIGHT: f32 = 1.0;
/// Test ratio of a range that is rejected whatever its gate says.
const REJECTED: f32 = 2.0;
/// Largest climb rate that a wrong acceleration is taken to have made within the lock-out, m/s: 7.5 m/s², more than the zero of
/// a shaken accelerometer moves.
const WRONG_CLIMB: f32 = 1.5;
/// The picture never moves farther in its longest interval, rad: 100 rad/s, more than any gyro measures.
const LARGEST_FLOW: f32 = 10.0;
/// Largest standard deviation of the height, m, and for each metre of distance: flow is the velocity over it, and a velocity that
/// may be half or twice as large is none.
const KNOWN_DISTANCE: f32 = 0.1;
const KNOWN_SHARE: f32 = 0.5;

/// A hand moves a vehicle so slowly that its camera sees it from here on, m.
const NEAREST: f32 = 0.02;
/// Flow does not correct height, climb rate and the zero that moves them. A leaning camera sees a part
/// of the climb. Where no range holds it, at the first instant of a take-off or after a reset, it is so
/// uncertain that a wrong distance, or a leg that slips, would become climb. Its uncertainty still
/// counts. In a hand nothing shakes the accelerometer, and what flow knows of the climb is worth having.
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
        if let Some(tested) = self.status.tested.get_mut(Counter::Tof as usize) {
            *tested = tested.wrapping_add(1);
        }
        if let Some(anchor) = self.anchor {
            // Stationary: the range measures the surface below the sensor, not the height of the vehicle.
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
        let surface = *self.surface.get_or_insert(delayed.state.position.z + below);
        let row = aid::tof::range(&delayed.state, &delayed.rotation, surface);
        // The beam is a cone and reports what is nearest in it: on a tilted body anything between the range along the
        // axis and the one straight down.
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
                    // No vehicle moves so far from one reading to the next: it is the surface that is another one.
                    self.surface = Some(surface - down);
                    return Ok(self.finish_reset(Sensor::Tof));
                }
                self.state.position.z += down;
                self.covariance.reset(POSITION + 2, 4.0 * variance);
                // A wrong height comes from a wrong climb rate, and that from a wrong acceleration in the time of the
                // lock-out: the next ranges estimate them anew.
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
        // The reading is the mean velocity over the interval: compare it with the state in the middle of it.
        let late = self.config.flow_delay + 0.5 * flow.interval;
        let middle = at - Duration::from_micros((late * 1e6) as u64);
        let age = self.admit(Sensor::Flow, middle, &[flow.delta_x, flow.delta_y])?;
        let Some(delayed) = &self.state_at(age) else { return Err(Refusal::Stale) };
        if delayed.rotation[2][2] < self.config.min_cos_tilt {
            return Err(Refusal::Tilt);
        }
        let surface = self.surface.ok_or(Refusal::Missing)?;
        let distance = (surface - delayed.state.position.z) / delayed.rotation[2][2];
        // At a take-off a leg may slip while the picture is blurred. After readings from a sharp distance
        // the velocity is known well enough for the last centimetres of a landing, and above a table.
        self.has_seen_floor = self.command.flying && (self.has_seen_floor || distance >= self.config.flow_min_distance);
        let takes_off = self.command.flying && !self.has_seen_floor;
        if distance < if takes_off { self.config.flow_min_distance } else { NEAREST } {
            return Err(Refusal::Range);
        }
        let uncertain = KNOWN_DISTANCE + KNOWN_SHARE * distance;
        if self.covariance.get(POSITION + 2, POSITION + 2) > uncertain * uncertain {
            return Err(Refusal::Missing);
        }
        let end = delayed.age - 0.5 * flow.interval;
        let turning = self.history.mean_rate(end, flow.interval).unwrap_or(self.rate);
        let raw = turning + self.state.gyro_bias;
        let rate = [flow.delta_x / flow.interval, flow.delta_y / flow.interval];
        let measured = aid::flow::measured_velocity(rate, [raw.x, raw.y], distance);
        let rows = aid::flow::body_velocity(&delayed.state, &delayed.rotation, distance);
        // Written out: `map` would be a call.
        let [x, y] = rows;
        let rows = [without_heading(x, &delayed.rotation[2]), without_heading(y, &delayed.rotation[2])];
        // The part of the error that grows with the image's motion must come from what is predicted: weighing a reading
        // by itself makes large readings count less and the velocity too small.
        let variance = |row: &Row, turning: f32| {
            let base = self.config.flow_sigma * distance;
            let scale = self.config.flow_scale_sigma * (row.predicted + turning * distance);
            base * base + scale * scale
        };
        let variances = [variance(&rows[0], raw.y), variance(&rows[1], -raw.x)];
        // One gate for both axes: a single axis locked out drifts unnoticed.
        let innovation = self.innovation(delayed, rows, measured, variances);
        let ratio = self.test_ratio(&innovation);
        self.status.flow_innovation = [measured[0] - rows[0].predicted, measured[1] - rows[1].predicted];
        self.status.flow_ratio = ratio;
        // Flow measures two axes of the body's; along the beam the velocity is the estimated one.
        let along = rotate_back(&delayed.rotation, &delayed.state.velocity).z;
        let world = rotate(&delayed.rotation, &Vec3::new(measured[0], measured[1], along));
        if self.anchor.is_none() {
            let fastest = self.config.flow_max_rate;
            // Of the vehicle itself: a zero that has moved turns nothing.
            match self.fast_turn.step([turning.x, turning.y], flow.interval, fastest) {
                Turn::Slow => {}
                Turn::Fast => return Err(Refusal::Range),
                Turn::Over(angle) => {
                    // From the next reading on.
                    self.inflate_turned(angle);
                    return Err(Refusal::Range);
                }
            }
            let length = |[x, y]: [f32; 2]| math::sqrt(x * x + y * y);
            let picture = length([rows[0].predicted / distance + raw.y, rows[1].predicted / distance - raw.x]);
            // The gate tests a picture that contradicts the estimate by more.
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
                // On the ground the zero-velocity update holds the velocity, so a bias of flow's innovations shows
                // nothing.
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
                // A wrong velocity comes from a wrong tilt or bias.
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
            // An altitude of what? The first fix says.
            return Err(Refusal::Missing);
        }
        if self.command.flying && self.anchor.is_none() && self.now.since(self.range_used) > RANGE_SILENT {
            // Only a range shows how the accelerometer's zero moves with the thrust; without one it may be anywhere near.
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
                // Where the receiver is silent, the zero that it has shown holds the height, and not the other way round.
                if let Some(offset) = self.baro_offset.as_mut().filter(|_| backup || !self.config.baro_backup) {
                    offset.update(residual, noise + height);
                    if backup {
                        // The same error of the height is in every difference.
                        offset.inflate((height - offset.variance()).max(0.0));
                    }
                }
                if backup {
                    return Ok(Fusion::Fused { ratio });
                }
                let innovation = if self.config.baro_backup {
                    // However many altitudes tell the height, it is not known better than the zero.
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
                    // A jump of the air pressure does not move the vehicle: reset the offset, which is no sign of
                    // divergence, and no aiding either.
                    self.baro_offset = Some(Offset::new(here, noise));
                    self.gates.restart_lockout(Sensor::Baro, self.now);
                    self.status.resets = self.status.resets.wrapping_add(1);
                    return Ok(Fusion::Reset);
                }
                if residual.abs() > BARO_REACH {
                    return Ok(Fusion::Gated { ratio });
                }
                // Nothing else holds the height: it was the filter that went astray.
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
            // No other sensor corrects the heading: inflate it, once per lock-out, until the field passes the gate
            // again.
            self.gates.restart_lockout(Sensor::Mag, self.now);
            let vertical = self.state.rotation()[2];
            for (axis, part) in vertical.iter().enumerate() {
                self.covariance.inflate(ATTITUDE + axis, 0.1 * part * part);
            }
        }
        Fusion::Gated { ratio }
    }
}

/// A flow row that does not observe the heading: without the part of its attitude columns along the vertical, as the
/// body sees it. In theory flow shows the heading while the vehicle accelerates; in practice a degree of mounting error
/// and the beat of pictures and reads turn the estimated heading by degrees a minute, where a calibrated gyro alone
/// keeps it within one.
#[inline(always)]
fn without_heading(mut row: Row, vertical: &[f32; 3]) -> Row {
    let [.., x, y, z, _, _, _, _, _, _] = &mut row.jacobian;
    let along = *x * vertical[0] + *y * vertical[1] + *z * vertical[2];
    *x -= along * vertical[0];
    *y -= along * vertical[1];
    *z -= along * vertical[2];
    row
}
