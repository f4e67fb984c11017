//! The accelerometer as an inclinometer.
//!
//! When the body's own acceleration is small, the specific force is −g seen from the body: f = Rᵀ·(0, 0, −g) + b.
//! With up = −Rᵀ·e_z·g = f₀, a small body rotation θ gives (I − \[θ\]×)·f₀ = f₀ + \[f₀\]×·θ; the accelerometer bias adds
//! itself.
//!
//! Only for a body that stands, is carried gently, or has nothing better: a multicopter's accelerometer always points
//! along its thrust, whatever the tilt, so in flight this model pulls the attitude towards level.

use super::Row;
use crate::filter::state::Rotation;
use crate::filter::{ACCEL_BIAS, ATTITUDE, Nominal};
use stampfly_types::GRAVITY;

/// Predicted specific force along body x, y and z.
#[inline]
#[must_use]
pub fn specific_force(state: &Nominal, rotation: &Rotation) -> [Row<3>; 3] {
    let [fx, fy, fz] = rotation[2].map(|r| -GRAVITY * r);
    let bias = state.accel_bias;
    [
        Row { predicted: fx + bias.x, jacobian: [(ATTITUDE + 1, -fz), (ATTITUDE + 2, fy), (ACCEL_BIAS, 1.0)] },
        Row { predicted: fy + bias.y, jacobian: [(ATTITUDE, fz), (ATTITUDE + 2, -fx), (ACCEL_BIAS + 1, 1.0)] },
        Row { predicted: fz + bias.z, jacobian: [(ATTITUDE, -fy), (ATTITUDE + 1, fx), (ACCEL_BIAS + 2, 1.0)] },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jacobian_matches_numerical_differentiation() {
        for axis in 0..3 {
            crate::aid::numeric::check(|state| {
                let row = specific_force(state, &state.rotation())[axis];
                // In units of g, so that the tolerance means the same as for the other models.
                Row { predicted: row.predicted * 0.1, jacobian: row.jacobian.map(|(i, v)| (i, v * 0.1)) }
            });
        }
    }
}
