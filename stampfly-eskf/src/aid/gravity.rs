//! The accelerometer as an inclinometer.
//!
//! The specific force is the body's own acceleration less gravity, seen from the body: f = Rᵀ·(a − g) + b. With
//! f₀ = Rᵀ·(a − g), a small body rotation θ gives (I − \[θ\]×)·f₀ = f₀ + \[f₀\]×·θ; the accelerometer bias adds itself.
//!
//! The acceleration a must come from elsewhere: zero for a body that stands or is carried gently, the change of a measured
//! velocity for one that flies (see [`Acceleration`]). Left at zero in flight the model pulls the attitude towards level,
//! because a multicopter's accelerometer points along its thrust, whatever the tilt.

use super::Row;
use crate::filter::state::{Rotation, rotate_back};
use crate::filter::{ACCEL_BIAS, ATTITUDE, Nominal};
use stampfly_types::{Duration, GRAVITY, Instant, Vec3};

/// Predicted specific force along body x, y and z of a body that accelerates by `acceleration` (world, m/s²).
#[inline]
#[must_use]
pub fn specific_force(state: &Nominal, rotation: &Rotation, acceleration: &Vec3) -> [Row; 3] {
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
/// No acceleration beyond this is believed, m/s².
const LARGEST: f32 = 5.0;
/// A velocity older than this says nothing about the acceleration.
const FORGET: Duration = Duration::from_micros(200_000);

/// The acceleration of the body as a sensor of velocity shows it: an α-β tracker (Kalata, "The Tracking Index", IEEE TAES
/// 20(2), 1984).
///
/// ```
/// use stampfly_eskf::aid::gravity::Acceleration;
/// use stampfly_types::{Instant, Vec3};
/// let mut acceleration = Acceleration::default();
/// for step in 0..100u64 {
///     acceleration.see(Instant::from_micros(step * 10_000), Vec3::x() * (step as f32 * 0.02));
/// }
/// assert!((acceleration.at(Instant::from_micros(990_000)) - 2.0 * Vec3::x()).amax() < 0.05);
/// assert_eq!(acceleration.at(Instant::from_micros(2_000_000)), Vec3::zeros());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Acceleration {
    seen: Option<Instant>,
    velocity: Vec3,
    acceleration: Vec3,
}

impl Acceleration {
    /// Takes a measured velocity, world, m/s. A gap starts it again.
    pub fn see(&mut self, at: Instant, velocity: Vec3) {
        match self.seen {
            Some(seen) if at <= seen => return,
            Some(seen) if at.since(seen) <= FORGET => {
                let dt = at.since(seen).seconds();
                let predicted = self.velocity + self.acceleration * dt;
                let error = velocity - predicted;
                // Stable for every step that is taken: both gains stay below one.
                let turn = (BANDWIDTH * dt).min(0.7);
                self.velocity = predicted + error * (2.0 * DAMPING * turn).min(1.0);
                let acceleration = self.acceleration + error * (turn * turn / dt);
                self.acceleration = acceleration.map(|v| v.clamp(-LARGEST, LARGEST));
            }
            _ => (self.velocity, self.acceleration) = (velocity, Vec3::zeros()),
        }
        self.seen = Some(at);
    }

    /// The acceleration, world, m/s²; zero when nothing was seen lately.
    #[must_use]
    pub fn at(&self, now: Instant) -> Vec3 {
        if self.seen.is_some_and(|seen| now.since(seen) <= FORGET) { self.acceleration } else { Vec3::zeros() }
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
