//! Gravity: the accelerometer as an inclinometer.
//!
//! The specific force is the body's own acceleration less gravity, in body axes: f = Rᵀ·(a − g) + b. With
//! f₀ = Rᵀ·(a − g), a small body rotation θ gives (I − \[θ\]×)·f₀ = f₀ + \[f₀\]×·θ; the accelerometer bias adds itself.
//!
//! The acceleration a must come from elsewhere: zero for a body that is stationary or carried gently, the change of a
//! measured velocity for one that flies (see [`Acceleration`]). Left at zero in flight the model pulls the attitude
//! towards level, because a multicopter's accelerometer points along its thrust, whatever the tilt.
//!
//! | in [`Eskf`](crate::Eskf) | condition |
//! |---|---|
//! | start | stationary, or nothing holds the velocity ([`WhenUnaided`](crate::GravityUse::WhenUnaided)), both with every fourth sample; or all samples in flight, by their mean over 10 ms ([`Always`](crate::GravityUse::Always)) |
//! | continue | the same, and a joint test ratio of the three axes of at most one |
//! | stop | in flight with `WhenUnaided`: flow, velocity or position was accepted within the last second |
//! | reset | rejected for longer than four times `lockout`: attitude inflated, velocity to zero with a large variance, accelerometer bias reset; once per lock-out |

use super::Row;
use crate::filter::state::{Rotation, rotate_back};
use crate::filter::{ACCEL_BIAS, ATTITUDE, NominalState};
use stampfly_types::{Duration, GRAVITY, Instant, Vec3};

/// Predicted specific force along body x, y and z of a body that accelerates by `acceleration` (world, m/s²).
#[inline]
#[must_use]
pub fn specific_force(state: &NominalState, rotation: &Rotation, acceleration: &Vec3) -> [Row; 3] {
    let force = Vec3::new(acceleration.x, acceleration.y, acceleration.z - GRAVITY);
    let f = rotate_back(rotation, &force);
    let bias = state.accel_bias;
    [
        Row::new(f.x + bias.x, [(ATTITUDE + 1, -f.z), (ATTITUDE + 2, f.y), (ACCEL_BIAS, 1.0)]),
        Row::new(f.y + bias.y, [(ATTITUDE, f.z), (ATTITUDE + 2, -f.x), (ACCEL_BIAS + 1, 1.0)]),
        Row::new(f.z + bias.z, [(ATTITUDE, -f.y), (ATTITUDE + 1, f.x), (ACCEL_BIAS + 2, 1.0)]),
    ]
}

/// Bandwidth and damping of the tracker, rad/s and 1: the α = 0.2 and β = 0.02 at 100 Hz of the StampFly's firmware.
const BANDWIDTH: f32 = 14.0;
const DAMPING: f32 = 0.7;
/// Largest acceleration tracked, m/s².
const MAX_ACCELERATION: f32 = 5.0;
/// Without a velocity for this long the acceleration is zero.
const TIMEOUT: Duration = Duration::from_micros(200_000);

/// Tracks the acceleration of the body from measured velocities: an α-β tracker (Kalata, "The Tracking Index", IEEE
/// TAES 20(2), 1984).
///
/// ```
/// use stampfly_eskf::aid::gravity::Acceleration;
/// use stampfly_types::{Instant, Vec3};
/// let mut acceleration = Acceleration::default();
/// for step in 0..100u64 {
///     acceleration.update(Instant::from_micros(step * 10_000), Vec3::x() * (step as f32 * 0.02));
/// }
/// assert!((acceleration.at(Instant::from_micros(990_000)) - 2.0 * Vec3::x()).amax() < 0.05);
/// assert_eq!(acceleration.at(Instant::from_micros(2_000_000)), Vec3::zeros());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Acceleration {
    updated: Option<Instant>,
    velocity: Vec3,
    acceleration: Vec3,
}

impl Acceleration {
    /// Updates with a measured velocity, world, m/s. Restarts after a gap.
    pub fn update(&mut self, at: Instant, velocity: Vec3) {
        match self.updated {
            Some(updated) if at <= updated => return,
            Some(updated) if at.since(updated) <= TIMEOUT => {
                let dt = at.since(updated).seconds();
                let predicted = self.velocity + self.acceleration * dt;
                let error = velocity - predicted;
                // Stable for every step that is taken: both gains stay below one.
                let phase = (BANDWIDTH * dt).min(0.7);
                self.velocity = predicted + error * (2.0 * DAMPING * phase).min(1.0);
                let acceleration = self.acceleration + error * (phase * phase / dt);
                self.acceleration = acceleration.map(|v| v.clamp(-MAX_ACCELERATION, MAX_ACCELERATION));
            }
            _ => (self.velocity, self.acceleration) = (velocity, Vec3::zeros()),
        }
        self.updated = Some(at);
    }

    /// The acceleration, world, m/s²; zero without a recent velocity.
    #[must_use]
    pub fn at(&self, now: Instant) -> Vec3 {
        if self.updated.is_some_and(|updated| now.since(updated) <= TIMEOUT) {
            self.acceleration
        } else {
            Vec3::zeros()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jacobian_matches_numerical_differentiation() {
        for axis in 0..3 {
            crate::aid::numeric::check(|state| {
                let row = specific_force(state, &state.rotation(), &Vec3::new(0.7, -1.2, 0.4))[axis];
                // In units of g, so that the tolerance means the same as for the other models.
                Row { predicted: row.predicted * 0.1, jacobian: row.jacobian.map(|v| v * 0.1) }
            });
        }
    }
}
