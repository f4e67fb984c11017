//! Airspeed along the nose: a measurement of the velocity relative to the air, and of the wind.
//!
//! z = x_bᵀ·Rᵀ·(v − w). The row is that of [`velocity::body`] for a vehicle that moves with v − w;
//! the two horizontal components of the wind enter with the opposite sign. The wind is a separate
//! estimate ([`Wind`]) that the caller keeps, so that a vehicle without the sensor pays nothing.
//! While a receiver measures the velocity, airspeeds estimate the wind. When the receiver is
//! silent, the estimated wind turns airspeeds into velocities, with the uncertainty of the wind
//! added.
//!
//! Conditions in [`Eskf::fuse_airspeed`](crate::Estimator::fuse_airspeed):
//! - **Start**: north is known, the speed is finite and at most `horizon` old.
//! - **Estimates the wind** while an external velocity is younger than two seconds. The second
//!   component of the wind becomes observable when the nose points in another direction.
//! - **Corrects the velocity** otherwise, with a test ratio of at most one.
//! - **Stop**: no further condition. There is no reset.
//!
//! Not for a vehicle that hovers: a pitot tube has no usable reading below about 5 m/s.

use super::{Row, velocity};
use crate::filter::NominalState;

/// Initial standard deviation of the wind along each axis, m/s: a fresh breeze.
const FIRST: f32 = 6.0;
/// Random walk of the wind, m/s/√s: 1 m/s in 100 s, the value of EKF2 (`EKF2_WIND_NSD` 0.1).
const WALK: f32 = 0.1;

/// Predicted airspeed for a wind of `[north, east]`, m/s.
#[must_use]
pub fn along_nose(state: &NominalState, [north, east]: [f32; 2]) -> Row {
    let mut moving = *state;
    moving.velocity.x -= north;
    moving.velocity.y -= east;
    let [nose, ..] = velocity::body(&moving);
    nose
}

/// Estimate of the horizontal wind from airspeeds.
///
/// ```
/// use stampfly_eskf::aid::airspeed::Wind;
/// let mut wind = Wind::default();
/// // At 12 m/s over ground the airspeed is 15 m/s to the north and 12 m/s to the east:
/// // wind from the north, 3 m/s.
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
    /// Variances along north and east, and their covariance, (m/s)².
    north: f32,
    east: f32,
    both: f32,
}

impl Default for Wind {
    /// Unknown wind.
    fn default() -> Self {
        Self { value: [0.0; 2], north: FIRST * FIRST, east: FIRST * FIRST, both: 0.0 }
    }
}

impl Wind {
    /// Velocity of the air, m/s north and east: the direction in which it moves, not from which it
    /// comes.
    #[must_use]
    pub const fn velocity(&self) -> [f32; 2] {
        self.value
    }

    /// Standard deviation of the less certain component, m/s.
    #[must_use]
    pub fn sigma(&self) -> f32 {
        stampfly_types::math::sqrt(self.north.max(self.east))
    }

    /// Variance along a horizontal unit vector, (m/s)².
    #[must_use]
    pub fn variance_along(&self, [x, y]: [f32; 2]) -> f32 {
        x * x * self.north + 2.0 * x * y * self.both + y * y * self.east
    }

    /// Propagates the variances by `seconds`.
    pub fn propagate(&mut self, seconds: f32) {
        let walk = WALK * WALK * seconds.max(0.0);
        // Bounded: no wind is less certain than at the start, however long the tube is silent.
        self.north = (self.north + walk).min(FIRST * FIRST);
        self.east = (self.east + walk).min(FIRST * FIRST);
    }

    /// Updates with the difference of ground speed and airspeed along a horizontal unit vector,
    /// m/s, and its variance, (m/s)², `seconds` after the last update. Ignored if the variance is
    /// not positive or a value is not finite.
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
