//! Airspeeds: while a receiver shows the velocity they show the wind, and then the wind shows the velocity.
//!
//! Both ways the error of the other estimate is the same in many samples, so neither is known better by them than the other is.

use super::gate::Sensor;
use super::wander::limited;
use super::*;
use crate::aid::airspeed::{Wind, along_nose};

/// A velocity from outside older than this shows no wind.
const SILENT: Duration = Duration::from_millis(2_000);
/// The nose must point at least so level that it has a direction.
const LEVEL_NOSE: f32 = 0.5;

impl Eskf {
    /// While a velocity from outside is younger than two seconds it only teaches the wind; then it holds the velocity, and with it the
    /// outputs valid, no better than the wind is known.
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
            // A tube that shows too much does so in every sample: taken for noise, its error would be a wind from aside as soon as the nose moves a little.
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
        let variance = limited(known, variance, wind.variance_along(nose));
        let innovation = self.innovation(delayed, [row], [speed], [variance]);
        Ok(self.update(&innovation, ratio))
    }
}
