//! Airspeed along the nose: the velocity relative to the air, and with it the wind.
//!
//! z = x_bᵀ·Rᵀ·(v − w): the row is that of [`velocity::body`] for a vehicle that moves by v − w, and against it that of the wind's two level
//! components. The wind is an estimate of its own ([`Wind`]), held by whoever has the sensor, so that a vehicle without one
//! pays nothing: while a receiver shows the velocity, airspeeds show the wind, and when it is silent the wind
//! that was learnt shows the velocity, no better than it is known.
//!
//! | in [`Eskf::fuse_airspeed`](crate::Estimator::fuse_airspeed) | condition |
//! |---|---|
//! | start | north is known, at most `horizon` old, a speed that is finite |
//! | learns the wind | a velocity from outside is younger than two seconds; that the nose has pointed elsewhere shows the other component |
//! | shows the velocity | otherwise, with a test ratio of at most one |
//! | stop | no condition of its own; never a reset |
//!
//! Not for a vehicle that hovers: below some 5 m/s a pitot tube measures nothing.

use super::{Row, velocity};
use crate::filter::NominalState;

/// First standard deviation of the wind along each axis, m/s: a fresh breeze.
const FIRST: f32 = 6.0;
/// Random walk of the wind, m/s/√s: one metre per second in a hundred seconds. EKF2 takes the same (`EKF2_WIND_NSD` 0.1).
const WALK: f32 = 0.1;

/// Predicted airspeed in this wind, m/s north and east.
#[must_use]
pub fn along_nose(state: &NominalState, [north, east]: [f32; 2]) -> Row {
    let mut moving = *state;
    moving.velocity.x -= north;
    moving.velocity.y -= east;
    let [nose, ..] = velocity::body(&moving);
    nose
}

/// The wind, as airspeeds show it.
///
/// ```
/// use stampfly_eskf::aid::airspeed::Wind;
/// let mut wind = Wind::default();
/// // To the north at 12 m/s over ground the air is met at 15, to the east at 12: three metres per second from the north.
/// for _ in 0..200 {
///     wind.learn(0.1, [1.0, 0.0], 12.0 - 15.0, 0.25);
///     wind.learn(0.1, [0.0, 1.0], 12.0 - 12.0, 0.25);
/// }
/// let [north, east] = wind.velocity();
/// assert!((north + 3.0).abs() < 0.05 && east.abs() < 0.05 && wind.sigma() < 0.3);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Wind {
    value: [f32; 2],
    /// Variances along north and east, and covariance, (m/s)².
    north: f32,
    east: f32,
    both: f32,
}

impl Default for Wind {
    /// Nothing is known.
    fn default() -> Self {
        Self { value: [0.0; 2], north: FIRST * FIRST, east: FIRST * FIRST, both: 0.0 }
    }
}

impl Wind {
    /// Velocity of the air, m/s north and east: where it goes, not where it comes from.
    #[must_use]
    pub const fn velocity(&self) -> [f32; 2] {
        self.value
    }

    /// Standard deviation of the component that is known worse, m/s.
    #[must_use]
    pub fn sigma(&self) -> f32 {
        stampfly_types::math::sqrt(self.north.max(self.east))
    }

    /// Variance along a level direction, (m/s)².
    #[must_use]
    pub fn variance_along(&self, [x, y]: [f32; 2]) -> f32 {
        x * x * self.north + 2.0 * x * y * self.both + y * y * self.east
    }

    /// Lets `seconds` pass.
    pub fn propagate(&mut self, seconds: f32) {
        let walk = WALK * WALK * seconds.max(0.0);
        self.north = (self.north + walk).min(FIRST * FIRST);
        self.east = (self.east + walk).min(FIRST * FIRST);
    }

    /// Takes the difference of ground speed and airspeed along a level direction, m/s, of this variance, (m/s)², `seconds` after the
    /// one before. A variance that is not positive changes nothing.
    pub fn learn(&mut self, seconds: f32, direction: [f32; 2], difference: f32, variance: f32) {
        self.propagate(seconds);
        let [x, y] = direction;
        let spread = [self.north * x + self.both * y, self.both * x + self.east * y];
        let sum = spread[0] * x + spread[1] * y + variance;
        if !(variance > 0.0 && sum.is_finite() && difference.is_finite()) {
            return;
        }
        let off = difference - (x * self.value[0] + y * self.value[1]);
        self.value = [self.value[0] + spread[0] / sum * off, self.value[1] + spread[1] / sum * off];
        self.north -= spread[0] * spread[0] / sum;
        self.both -= spread[0] * spread[1] / sum;
        self.east -= spread[1] * spread[1] / sum;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jacobian_matches_numerical_differentiation() {
        crate::aid::numeric::check(|state| along_nose(state, [2.0, -1.0]));
    }

    #[test]
    fn one_direction_shows_one_component() {
        let mut wind = Wind::default();
        for _ in 0..1_000 {
            wind.learn(0.1, [0.8, 0.6], 2.0, 0.1);
        }
        assert!(wind.variance_along([0.8, 0.6]) < 0.1 && wind.variance_along([-0.6, 0.8]) > 30.0, "{wind:?}");
        let before = wind;
        wind.learn(0.0, [1.0, 0.0], f32::NAN, 0.1);
        wind.learn(0.0, [1.0, 0.0], 1.0, 0.0);
        assert_eq!(wind, before);
    }
}
