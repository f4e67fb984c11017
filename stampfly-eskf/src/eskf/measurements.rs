//! What happens to each kind of measurement: admitted, compared with its model, gated, absorbed, or believed after a
//! lock-out. One function a sensor; the models are in [`aid`](crate::aid).

use super::*;

impl Eskf {
    pub(super) fn try_tof(&mut self, at: Micros, tof: &TofData) -> Result<Fusion, Refusal> {
        self.admit(at, &[tof.distance])?;
        if !tof.valid {
            return Err(Refusal::Quality);
        }
        if !(self.config.tof_min..=self.config.tof_max).contains(&tof.distance) {
            return Err(Refusal::Range);
        }
        if self.rotation[2][2] < self.config.min_cos_tilt {
            return Err(Refusal::Tilt);
        }
        let below = tof.distance * self.rotation[2][2];
        if let Some(anchor) = self.anchor {
            // Standing: the range says how far below the sensor the ground is, not where the vehicle is.
            let seen = anchor.z + below;
            self.surface = Some(self.surface.map_or(seen, |surface| surface + 0.1 * (seen - surface)));
            self.tof.fused = Some(self.now);
            return Ok(Fusion::Fused { ratio: 0.0 });
        }
        let surface = *self.surface.get_or_insert(self.state.position.z + below);
        let delay = self.now.since(at).seconds();
        let row = aid::tof::range(&self.state, &self.rotation, surface, delay);
        // The beam is a cone and reports what is nearest in it: on a tilted body anything between the range along the axis
        // and the one straight down.
        let cone = tof.distance * (1.0 - self.rotation[2][2]);
        let sigma = self.config.tof_sigma.max(tof.sigma) + cone;
        let projection = self.covariance.project(row.jacobian, sigma * sigma);
        let innovation = tof.distance - row.predicted;
        let ratio = self.ratio(innovation, projection.variance);
        self.status.tof_innovation = innovation;
        self.status.tof_ratio = ratio;
        if ratio > 1.0 {
            if self.gated(|s| &mut s.tof) {
                self.state.position.z = surface - below;
                self.covariance.reset(POSITION + 2, 4.0 * sigma * sigma);
                // Whatever carried the height away was a velocity: let the next ranges find it.
                self.covariance.reset(VELOCITY + 2, 1.0);
                self.covariance.inflate(ACCEL_BIAS + 2, 0.04);
                self.tof = Aid { fused: Some(self.now), gated_since: None };
                self.status.resets = self.status.resets.wrapping_add(1);
                return Ok(Fusion::Reset);
            }
            return Ok(Fusion::Gated { ratio });
        }
        self.correct(&projection, innovation);
        self.tof.fused = Some(self.now);
        self.tof.gated_since = None;
        Ok(Fusion::Fused { ratio })
    }

    pub(super) fn try_flow(&mut self, at: Micros, flow: &FlowData) -> Result<Fusion, Refusal> {
        self.admit(at, &[flow.delta_x, flow.delta_y, flow.interval])?;
        if !flow.valid || flow.quality < self.config.flow_min_quality {
            return Err(Refusal::Quality);
        }
        if !(1e-3..=0.1).contains(&flow.interval) {
            return Err(Refusal::Range);
        }
        if self.rotation[2][2] < self.config.min_cos_tilt {
            return Err(Refusal::Tilt);
        }
        let surface = self.surface.ok_or(Refusal::Missing)?;
        let distance = (surface - self.state.position.z) / self.rotation[2][2];
        if distance < self.config.flow_min_distance {
            return Err(Refusal::Range);
        }
        let seen = Micros(at.0.saturating_sub((self.config.flow_delay * 1e6) as u64));
        let raw = self.rates.mean(seen, flow.interval).unwrap_or(self.imu.gyro);
        let rate = [flow.delta_x / flow.interval, flow.delta_y / flow.interval];
        let measured = aid::flow::measured_velocity(rate, [raw.x, raw.y], distance);
        let rows = aid::flow::body_velocity(&self.state, &self.rotation, distance).map(without_heading);
        // The part of the error that grows with the image's motion must come from what is predicted: weighing a reading
        // by itself makes large readings count less and the velocity too small.
        let variance = |row: &Row<6>, turning: f32| {
            let base = self.config.flow_sigma * distance;
            let scale = self.config.flow_scale_sigma * (row.predicted + turning * distance);
            base * base + scale * scale
        };
        let variances = [variance(&rows[0], raw.y), variance(&rows[1], -raw.x)];
        // Both axes pass or neither does: a single axis locked out drifts unnoticed.
        let first = self.covariance.project(rows[0].jacobian, variances[0]);
        let second = self.covariance.project(rows[1].jacobian, variances[1]);
        let innovation = [measured[0] - rows[0].predicted, measured[1] - rows[1].predicted];
        let ratio = self.ratio(innovation[0], first.variance).max(self.ratio(innovation[1], second.variance));
        self.status.flow_innovation = innovation;
        self.status.flow_ratio = ratio;
        if ratio > 1.0 {
            if self.gated(|s| &mut s.flow) {
                let body = Vec3::new(measured[0], measured[1], 0.0);
                let world = crate::filter::state::rotate(&self.rotation, &body);
                self.state.velocity.x = world.x;
                self.state.velocity.y = world.y;
                for (axis, variance) in variances.into_iter().enumerate() {
                    self.covariance.reset(VELOCITY + axis, 4.0 * variance + 0.01);
                    self.covariance.inflate(ATTITUDE + axis, 0.01);
                    self.covariance.inflate(ACCEL_BIAS + axis, 0.01);
                    self.covariance.inflate(GYRO_BIAS + axis, 1e-5);
                }
                self.flow = Aid { fused: Some(self.now), gated_since: None };
                self.status.resets = self.status.resets.wrapping_add(1);
                return Ok(Fusion::Reset);
            }
            return Ok(Fusion::Gated { ratio });
        }
        self.correct(&first, innovation[0]);
        let row = without_heading(aid::flow::body_velocity(&self.state, &self.rotation, distance)[1]);
        let projection = self.covariance.project(row.jacobian, variances[1]);
        self.correct(&projection, measured[1] - row.predicted);
        self.flow.fused = Some(self.now);
        self.flow.gated_since = None;
        Ok(Fusion::Fused { ratio })
    }

    pub(super) fn try_baro(&mut self, at: Micros, baro: &BaroData) -> Result<Fusion, Refusal> {
        self.admit(at, &[baro.altitude])?;
        if !self.config.baro_enable {
            return Err(Refusal::NotUsed);
        }
        let here = baro.altitude + self.state.position.z;
        if self.anchor.is_some() || self.tof.is_recent(self.now) {
            // A better height is at hand: only learn where the barometer's zero has drifted to.
            self.baro_offset = Some(self.baro_offset.map_or(here, |offset| offset + 0.05 * (here - offset)));
            return Err(Refusal::NotUsed);
        }
        let offset = *self.baro_offset.get_or_insert(here);
        let row = aid::baro::altitude(&self.state, offset);
        let projection = self.covariance.project(row.jacobian, self.config.baro_sigma * self.config.baro_sigma);
        let innovation = baro.altitude - row.predicted;
        let ratio = self.ratio(innovation, projection.variance);
        self.status.baro_innovation = innovation;
        self.status.baro_ratio = ratio;
        if ratio > 1.0 {
            if self.gated(|s| &mut s.baro) {
                self.baro_offset = Some(here);
                self.baro.gated_since = None;
                return Ok(Fusion::Reset);
            }
            return Ok(Fusion::Gated { ratio });
        }
        self.correct(&projection, innovation);
        self.baro.fused = Some(self.now);
        self.baro.gated_since = None;
        Ok(Fusion::Fused { ratio })
    }

    pub(super) fn try_mag(&mut self, at: Micros, mag: &MagData) -> Result<Fusion, Refusal> {
        self.admit(at, mag.field.as_slice())?;
        if !self.config.mag_enable {
            return Err(Refusal::NotUsed);
        }
        if !(10.0..=100.0).contains(&mag.field.norm()) {
            return Err(Refusal::Range);
        }
        let reference = self.mag_reference.ok_or(Refusal::Missing)?;
        let row = aid::heading::error(&self.rotation, &mag.field, reference).ok_or(Refusal::Range)?;
        let projection = self.covariance.project(row.jacobian, self.config.mag_sigma * self.config.mag_sigma);
        let innovation = -row.predicted;
        let ratio = self.ratio(innovation, projection.variance);
        self.status.mag_innovation = innovation;
        self.status.mag_ratio = ratio;
        if ratio > 1.0 {
            if self.gated(|s| &mut s.mag) {
                // The heading is nobody else's to hold: doubt it, once per lock-out, until the field fits in again.
                self.mag.gated_since = Some(self.now);
                for axis in 0..3 {
                    self.covariance.inflate(ATTITUDE + axis, 0.1 * self.rotation[2][axis] * self.rotation[2][axis]);
                }
            }
            return Ok(Fusion::Gated { ratio });
        }
        self.correct(&projection, innovation);
        self.mag.fused = Some(self.now);
        self.mag.gated_since = None;
        Ok(Fusion::Fused { ratio })
    }

    pub(super) fn try_velocity(&mut self, at: Micros, velocity: &Vec3, sigma: f32) -> Result<Fusion, Refusal> {
        self.admit(at, &[velocity.x, velocity.y, velocity.z, sigma])?;
        let variance = (sigma * sigma).max(1e-6);
        let mut ratio = 0.0f32;
        for axis in 0..3 {
            let projection = self.covariance.project([(VELOCITY + axis, 1.0)], variance);
            ratio = ratio.max(self.ratio(velocity[axis] - self.state.velocity[axis], projection.variance));
        }
        if ratio > 1.0 {
            if self.gated(|s| &mut s.velocity) {
                self.state.velocity = *velocity;
                for axis in 0..3 {
                    self.covariance.reset(VELOCITY + axis, 4.0 * variance);
                    self.covariance.inflate(ATTITUDE + axis, 0.01);
                }
                self.velocity = Aid { fused: Some(self.now), gated_since: None };
                self.status.resets = self.status.resets.wrapping_add(1);
                return Ok(Fusion::Reset);
            }
            return Ok(Fusion::Gated { ratio });
        }
        for axis in 0..3 {
            let projection = self.covariance.project([(VELOCITY + axis, 1.0)], variance);
            let innovation = velocity[axis] - self.state.velocity[axis];
            self.correct(&projection, innovation);
        }
        self.velocity.fused = Some(self.now);
        self.velocity.gated_since = None;
        Ok(Fusion::Fused { ratio })
    }
}
