//! What happens to each kind of measurement: admitted, compared with its model at its own time, gated, absorbed, or
//! believed after a lock-out. One function a sensor; the models are in [`aid`](crate::aid).

use super::gate::{Sensor, Verdict};
use super::*;
use crate::config::MagModel;

impl Eskf {
    pub(super) fn try_tof(&mut self, at: Instant, tof: &TofData) -> Result<Fusion, Refusal> {
        let then = self.admit(Sensor::Tof, at, &[tof.distance])?;
        if !tof.valid {
            return Err(Refusal::Quality);
        }
        if !(self.config.tof_min..=self.config.tof_max).contains(&tof.distance) {
            return Err(Refusal::Range);
        }
        let cos_tilt = then.rotation[2][2];
        if cos_tilt < self.config.min_cos_tilt {
            return Err(Refusal::Tilt);
        }
        let below = tof.distance * cos_tilt;
        if let Some(anchor) = self.anchor {
            // Standing: the range says how far below the sensor the ground is, not where the vehicle is.
            let seen = anchor.z + below;
            self.surface = Some(self.surface.map_or(seen, |surface| surface + 0.1 * (seen - surface)));
            self.gates.accept(Sensor::Tof, self.now);
            return Ok(Fusion::Fused { ratio: 0.0 });
        }
        let surface = *self.surface.get_or_insert(then.state.position.z + below);
        let row = aid::tof::range(&then.state, &then.rotation, surface);
        // The beam is a cone and reports what is nearest in it: on a tilted body anything between the range along the axis
        // and the one straight down.
        let cone = tof.distance * (1.0 - cos_tilt);
        let sigma = self.config.tof_sigma.max(tof.sigma) + cone;
        let variance = sigma * sigma;
        let projection = self.compare(&then, [row], [tof.distance], [variance]);
        let ratio = self.ratio(&projection);
        self.status.tof_innovation = tof.distance - row.predicted;
        self.status.tof_ratio = ratio;
        match self.gates.judge(Sensor::Tof, self.now, ratio, self.config.lockout) {
            Verdict::Fuse => Ok(self.absorb(&projection, ratio)),
            Verdict::Leave => Ok(Fusion::Gated { ratio }),
            Verdict::Believe => {
                self.state.position.z += surface - below - then.state.position.z;
                self.covariance.reset(POSITION + 2, 4.0 * variance);
                // Whatever carried the height away was a velocity: let the next ranges find it.
                self.covariance.reset(VELOCITY + 2, 1.0);
                self.covariance.inflate(ACCEL_BIAS + 2, 0.04);
                Ok(self.moved_to(Sensor::Tof))
            }
        }
    }

    pub(super) fn try_flow(&mut self, at: Instant, flow: &FlowData) -> Result<Fusion, Refusal> {
        if !flow.valid || flow.quality < self.config.flow_min_quality {
            return Err(Refusal::Quality);
        }
        if !(1e-3..=0.1).contains(&flow.interval) {
            return Err(Refusal::Range);
        }
        // What is compared is the velocity in the middle of the stretch of time that was seen.
        let late = self.config.flow_delay + 0.5 * flow.interval;
        let seen = at - Duration::from_micros((late * 1e6) as u64);
        let then = self.admit(Sensor::Flow, seen, &[flow.delta_x, flow.delta_y])?;
        if then.rotation[2][2] < self.config.min_cos_tilt {
            return Err(Refusal::Tilt);
        }
        let surface = self.surface.ok_or(Refusal::Missing)?;
        let distance = (surface - then.state.position.z) / then.rotation[2][2];
        if distance < self.config.flow_min_distance {
            return Err(Refusal::Range);
        }
        let end = then.age - 0.5 * flow.interval;
        let raw = self.history.mean_rate(end, flow.interval).unwrap_or(self.rate) + self.state.gyro_bias;
        let rate = [flow.delta_x / flow.interval, flow.delta_y / flow.interval];
        let measured = aid::flow::measured_velocity(rate, [raw.x, raw.y], distance);
        let rows = aid::flow::body_velocity(&then.state, &then.rotation, distance);
        let rows = rows.map(|row| without_heading(row, &then.rotation[2]));
        // The part of the error that grows with the image's motion must come from what is predicted: weighing a reading
        // by itself makes large readings count less and the velocity too small.
        let variance = |row: &Row, turning: f32| {
            let base = self.config.flow_sigma * distance;
            let scale = self.config.flow_scale_sigma * (row.predicted + turning * distance);
            base * base + scale * scale
        };
        let variances = [variance(&rows[0], raw.y), variance(&rows[1], -raw.x)];
        // Both axes pass or neither does: a single axis locked out drifts unnoticed.
        let projection = self.compare(&then, rows, measured, variances);
        let ratio = self.ratio(&projection);
        self.status.flow_innovation = [measured[0] - rows[0].predicted, measured[1] - rows[1].predicted];
        self.status.flow_ratio = ratio;
        // Flow sees two axes of the body's; along the beam the velocity is what it was thought to be.
        let along = rotate_back(&then.rotation, &then.state.velocity).z;
        let world = rotate(&then.rotation, &Vec3::new(measured[0], measured[1], along));
        self.acceleration.see(seen, world);
        match self.gates.judge(Sensor::Flow, self.now, ratio, self.config.lockout) {
            Verdict::Fuse => {
                let fusion = self.absorb(&projection, ratio);
                // On the ground nothing moves, so nothing is learned from what does not fit.
                if self.anchor.is_none() && self.persistence.see(projection.innovations(), flow.interval) {
                    self.doubt();
                }
                Ok(fusion)
            }
            Verdict::Leave => Ok(Fusion::Gated { ratio }),
            Verdict::Believe => {
                self.state.velocity.x += world.x - then.state.velocity.x;
                self.state.velocity.y += world.y - then.state.velocity.y;
                for (axis, variance) in variances.into_iter().enumerate() {
                    self.covariance.reset(VELOCITY + axis, 4.0 * variance + 0.01);
                }
                // Whatever carried the velocity away was a tilt or a bias.
                self.doubt_tilt();
                Ok(self.moved_to(Sensor::Flow))
            }
        }
    }

    pub(super) fn try_baro(&mut self, at: Instant, baro: &BaroData) -> Result<Fusion, Refusal> {
        if !self.config.baro_enable {
            return Err(Refusal::NotUsed);
        }
        let then = self.admit(Sensor::Baro, at, &[baro.altitude])?;
        let noise = self.config.baro_sigma * self.config.baro_sigma;
        let here = baro.altitude + then.state.position.z;
        let since = core::mem::replace(&mut self.baro_seen, self.now);
        let offset = self.baro_offset.get_or_insert(Offset::new(here, noise));
        offset.drift(self.now.since(since).seconds(), self.config.baro_walk);
        let offset = *offset;
        let row = aid::baro::altitude(&then.state, offset.value());
        let innovation = baro.altitude - row.predicted;
        let projection = self.compare(&then, [row], [baro.altitude], [noise + offset.variance()]);
        let ratio = self.ratio(&projection);
        self.status.baro_innovation = innovation;
        self.status.baro_ratio = ratio;
        match self.gates.judge(Sensor::Baro, self.now, ratio, self.config.lockout) {
            Verdict::Fuse => {
                if let Some(offset) = &mut self.baro_offset {
                    offset.learn(innovation, noise + self.covariance.get(POSITION + 2, POSITION + 2));
                }
                Ok(self.absorb(&projection, ratio))
            }
            Verdict::Leave => Ok(Fusion::Gated { ratio }),
            Verdict::Believe => {
                // Air that jumps does not move the vehicle: what is believed is a new offset, and nothing is lost.
                self.baro_offset = Some(Offset::new(here, noise));
                self.gates.accept(Sensor::Baro, self.now);
                self.status.resets = self.status.resets.wrapping_add(1);
                Ok(Fusion::Reset)
            }
        }
    }

    pub(super) fn try_mag(&mut self, at: Instant, mag: &MagData) -> Result<Fusion, Refusal> {
        if !self.config.mag_enable {
            return Err(Refusal::NotUsed);
        }
        let then = self.admit(Sensor::Mag, at, mag.field.as_slice())?;
        let strength = mag.field.norm();
        if !(10.0..=100.0).contains(&strength) {
            return Err(Refusal::Range);
        }
        let reference = self.field.ok_or(Refusal::Missing)?;
        let variance = self.config.mag_sigma * self.config.mag_sigma;
        let heading = math::atan2(reference.y, reference.x);
        let row = aid::heading::error(&then.rotation, &mag.field, heading).ok_or(Refusal::Range)?;
        self.status.mag_innovation = -row.predicted;
        match self.config.mag_model {
            MagModel::Heading => {
                let projection = self.compare(&then, [row], [0.0], [variance]);
                let ratio = self.ratio(&projection);
                Ok(self.judge_mag(&projection, ratio))
            }
            MagModel::Field => {
                let rows = aid::field::direction(&then.rotation, &reference);
                let direction = mag.field / strength;
                let measured = [direction.x, direction.y, direction.z];
                let projection = self.compare(&then, rows, measured, [variance; 3]);
                let ratio = self.ratio(&projection);
                Ok(self.judge_mag(&projection, ratio))
            }
        }
    }

    fn judge_mag<const M: usize>(&mut self, projection: &Projection<M>, ratio: f32) -> Fusion {
        self.status.mag_ratio = ratio;
        let verdict = self.gates.judge(Sensor::Mag, self.now, ratio, self.config.lockout);
        if verdict == Verdict::Fuse {
            return self.absorb(projection, ratio);
        }
        if verdict == Verdict::Believe {
            // The heading is nobody else's to hold: doubt it, once per lock-out, until the field fits in again.
            self.gates.wait(Sensor::Mag, self.now);
            let vertical = self.state.rotation()[2];
            for (axis, part) in vertical.iter().enumerate() {
                self.covariance.inflate(ATTITUDE + axis, 0.1 * part * part);
            }
        }
        Fusion::Gated { ratio }
    }

    pub(super) fn try_velocity(&mut self, at: Instant, velocity: &Vec3, sigma: f32) -> Result<Fusion, Refusal> {
        let then = self.admit(Sensor::Velocity, at, &[velocity.x, velocity.y, velocity.z, sigma])?;
        let variance = (sigma * sigma).max(1e-6);
        let rows = aid::velocity::world(&then.state);
        let projection = self.compare(&then, rows, (*velocity).into(), [variance; 3]);
        let ratio = self.ratio(&projection);
        self.acceleration.see(at, *velocity);
        match self.gates.judge(Sensor::Velocity, self.now, ratio, self.config.lockout) {
            Verdict::Fuse => Ok(self.absorb(&projection, ratio)),
            Verdict::Leave => Ok(Fusion::Gated { ratio }),
            Verdict::Believe => {
                self.state.velocity += velocity - then.state.velocity;
                for axis in 0..3 {
                    self.covariance.reset(VELOCITY + axis, 4.0 * variance);
                    self.covariance.inflate(ATTITUDE + axis, 0.01);
                }
                Ok(self.moved_to(Sensor::Velocity))
            }
        }
    }

    pub(super) fn try_position(&mut self, at: Instant, position: &Vec3, sigma: f32) -> Result<Fusion, Refusal> {
        let then = self.admit(Sensor::Position, at, &[position.x, position.y, position.z, sigma])?;
        let variance = (sigma * sigma).max(1e-8);
        let rows = aid::position::world(&then.state);
        let projection = self.compare(&then, rows, (*position).into(), [variance; 3]);
        let ratio = self.ratio(&projection);
        match self.gates.judge(Sensor::Position, self.now, ratio, self.config.lockout) {
            Verdict::Fuse => Ok(self.absorb(&projection, ratio)),
            Verdict::Leave => Ok(Fusion::Gated { ratio }),
            Verdict::Believe => {
                let jump = position - then.state.position;
                self.state.position += jump;
                // The floor did not move, only the idea of where this is.
                self.surface = self.surface.map(|surface| surface + jump.z);
                for axis in 0..3 {
                    self.covariance.reset(POSITION + axis, 4.0 * variance);
                    self.covariance.reset(VELOCITY + axis, 1.0);
                    self.covariance.inflate(ATTITUDE + axis, 0.01);
                }
                Ok(self.moved_to(Sensor::Position))
            }
        }
    }

    pub(super) fn try_attitude(&mut self, at: Instant, attitude: &Quat, sigma: f32) -> Result<Fusion, Refusal> {
        let [x, y, z, w]: [f32; 4] = attitude.coords.into();
        let then = self.admit(Sensor::Attitude, at, &[w, x, y, z, sigma])?;
        let variance = (sigma * sigma).max(1e-8);
        let missing = aid::attitude::missing(then.state.attitude, [w, x, y, z]);
        let projection = self.compare(&then, aid::attitude::rows(), missing.into(), [variance; 3]);
        let ratio = self.ratio(&projection);
        match self.gates.judge(Sensor::Attitude, self.now, ratio, self.config.lockout) {
            Verdict::Fuse => Ok(self.absorb(&projection, ratio)),
            Verdict::Leave => Ok(Fusion::Gated { ratio }),
            Verdict::Believe => {
                self.state.attitude = multiply([w, x, y, z], then.passage.turn);
                self.forget_past();
                for axis in 0..3 {
                    self.covariance.reset(ATTITUDE + axis, 4.0 * variance);
                    self.covariance.inflate(VELOCITY + axis, 0.1);
                    self.covariance.inflate(GYRO_BIAS + axis, 1e-5);
                }
                Ok(self.moved_to(Sensor::Attitude))
            }
        }
    }
}

/// A flow row that says nothing about the heading: without the part of its attitude columns along the vertical, as the
/// body sees it. In theory flow shows the heading while the vehicle accelerates; in practice a degree of mounting error
/// and the beat of pictures and reads turn the vehicle's idea of north by degrees a minute, where a calibrated gyro alone
/// keeps it within one.
fn without_heading(mut row: Row, vertical: &[f32; 3]) -> Row {
    let [.., x, y, z, _, _, _, _, _, _] = &mut row.jacobian;
    let along = *x * vertical[0] + *y * vertical[1] + *z * vertical[2];
    *x -= along * vertical[0];
    *y -= along * vertical[1];
    *z -= along * vertical[2];
    row
}
