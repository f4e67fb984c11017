//! Gravity: the accelerometer as an inclinometer.
//!
//! The specific force is the body's acceleration minus gravity, in body axes: f = Rᵀ·(a − g) + b.
//! With f₀ = Rᵀ·(a − g), a small body rotation θ gives (I − \[θ\]×)·f₀ = f₀ + \[f₀\]×·θ; the
//! accelerometer bias is added.
//!
//! The acceleration a is an input: zero for a body that is stationary or moved gently, the
//! derivative of a measured velocity for one that flies (see [`Acceleration`]). With zero in flight
//! the model pulls the attitude towards level, because a multicopter's accelerometer points along
//! its thrust, whatever the tilt.
//!
//! Conditions in [`Eskf`](crate::Eskf):
//! - **Start**, every fourth sample: stationary, or the velocity is not measured
//!   ([`WhenUnaided`](crate::GravityUse::WhenUnaided)). With [`Always`](crate::GravityUse::Always):
//!   all samples in flight, as their mean over 10 ms.
//! - **Continue**: the same, and a joint test ratio of the three axes of at most one.
//! - **Stop**, in flight with `WhenUnaided`: flow, external velocity or position was accepted
//!   within the last second.
//! - **Reset**: rejected for longer than four times `lockout`. The attitude is inflated, the
//!   velocity is set to zero with a large variance, the accelerometer bias is reset; once per
//!   lock-out.

use super::Row;
use crate::filter::state::{Rotation, rotate_back};
use crate::filter::{ACCEL_BIAS, ATTITUDE, NominalState};
use stampfly_types::{Duration, GRAVITY, Instant, Vec3};

/// Predicted specific force along body x, y and z, m/s², of a body with this `acceleration` (world,
/// m/s²).
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

/// Bandwidth of the tracker, rad/s, and its damping ratio: α = 0.2 and β = 0.02 at 100 Hz in the
/// StampFly's firmware.
const BANDWIDTH: f32 = 14.0;
const DAMPING: f32 = 0.7;
/// Largest acceleration tracked along an axis, m/s².
const MAX_ACCELERATION: f32 = 5.0;
/// After this time without a velocity the acceleration is zero.
const TIMEOUT: Duration = Duration::from_micros(200_000);

/// Acceleration of the body from measured velocities: an α-β tracker (Kalata, "The Tracking Index",
/// IEEE TAES 20(2), 1984).
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
    /// Updates with a measured velocity, world, m/s. Restarts after a gap; ignores samples that are
    /// not newer.
    pub fn update(&mut self, at: Instant, velocity: Vec3) {
        match self.updated {
            Some(updated) if at <= updated => return,
            Some(updated) if at.since(updated) <= TIMEOUT => {
                let dt = at.since(updated).seconds();
                let predicted = self.velocity + self.acceleration * dt;
                let error = velocity - predicted;
                // Both gains stay below one, so the tracker is stable for every accepted interval.
                let phase = (BANDWIDTH * dt).min(0.7);
                self.velocity = predicted + error * (2.0 * DAMPING * phase).min(1.0);
                let acceleration = self.acceleration + error * (phase * phase / dt);
                self.acceleration = acceleration.map(|v| v.clamp(-MAX_ACCELERATION, MAX_ACCELERATION));
            }
            _ => (self.velocity, self.acceleration) = (velocity, Vec3::zeros()),
        }
        self.updated = Some(at);
    }

    /// The acceleration, world, m/s². Zero without a recent velocity.
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
