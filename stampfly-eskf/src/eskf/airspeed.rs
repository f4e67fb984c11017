//! Airspeed updates: they estimate the wind while a receiver measures the velocity, and the
//! velocity afterwards.
//!
//! In both directions the error of the other estimate is common to many samples. The update
//! therefore never makes one of them more certain than the other.

use super::gate::Sensor;
use super::wander::limited;
use super::*;
use crate::aid::airspeed::{Wind, along_nose};

/// After this time without an external velocity, airspeeds correct the velocity instead of the
/// wind.
const SILENT: Duration = Duration::from_millis(2_000);
/// Smallest horizontal component of the nose direction; a steeper nose has no usable heading.
const LEVEL_NOSE: f32 = 0.5;

impl Eskf {
    /// While an external velocity is younger than two seconds, updates only the wind. Afterwards
    /// updates the velocity and keeps the outputs valid, no more certain than the wind.
    pub(super) fn update_airspeed(
        &mut self,
        at: Instant,
        speed: f32,
        sigma: f32,
        wind: &mut Wind,
    ) -> Result<Fusion, Refusal> {
        let age = self.place_in_time(at, &[speed, sigma])?;
        if !self.is_north_known() {
            return Err(Refusal::Missing);
        }
        let Some(delayed) = &self.state_at(age) else { return Err(Refusal::Stale) };
        let [[x, ..], [y, ..], _] = delayed.rotation;
        let level = math::sqrt(x * x + y * y);
        if level < LEVEL_NOSE {
            return Err(Refusal::Tilt);
        }
        let nose = [x / level, y / level];
        let variance = (sigma * sigma).max(1e-4);
        let p = |i: usize, j: usize| self.covariance.get(VELOCITY + i, VELOCITY + j);
        let known = nose[0] * nose[0] * p(0, 0) + 2.0 * nose[0] * nose[1] * p(0, 1) + nose[1] * nose[1] * p(1, 1);
        let row = along_nose(&delayed.state, wind.velocity());
        if self.gates.is_recent_within(Sensor::Velocity, self.now, SILENT) {
            let off = (row.predicted - speed) / level;
            let [north, east] = wind.velocity();
            let along = nose[0] * north + nose[1] * east;
            // A scale error of the tube is the same in every sample. Treated as white noise, it
            // would become a false crosswind as soon as the nose turns a little. So one direction
            // of the nose teaches at most one sample.
            let doubt = variance + known;
            wind.learn(0.0, nose, along + off, limited(wind.variance_along(nose), doubt, doubt));
            return Ok(Fusion::Fused { ratio: 0.0 });
        }
        let innovation = self.innovation(delayed, [row], [speed], [variance + wind.variance_along(nose)]);
        let ratio = self.test_ratio(&innovation);
        if ratio > 1.0 {
            return Ok(Fusion::Gated { ratio });
        }
        self.aided(&[true, true, false]);
        // The wind's error is common to all samples: bound what they can add up to.
        let variance = limited(known, variance, wind.variance_along(nose));
        let innovation = self.innovation(delayed, [row], [speed], [variance]);
        Ok(self.update(&innovation, ratio))
    }
}
