//! Range to a level surface, along the body's z axis.
//!
//! With the surface at height zero (down coordinate `surface`) the beam of a tilted body meets it at
//! d = (surface − p_z) / R₃₃. Derivatives: ∂d/∂p_z = −1/R₃₃; a small body rotation θ changes R₃₃ by
//! R₃₁·θ_y − R₃₂·θ_x, hence ∂d/∂θ_x = d·R₃₂/R₃₃ and ∂d/∂θ_y = −d·R₃₁/R₃₃.
//!
//! Not for walls, stairs or a beam that leaves the body elsewhere.
//!
//! | in [`Eskf`](crate::Eskf) | condition |
//! |---|---|
//! | start | a valid range within `tof_min` to `tof_max`, tilt within `min_cos_tilt`; the first one in flight defines the surface |
//! | continue | the same, and a test ratio of at most one; on the ground it measures the surface instead of the height |
//! | stop | invalid, out of range or tilted: refused at once, inactive one second after the last accepted range |
//! | reset | rejected for longer than `lockout`: height to the range; variance of height and climb rate reset, vertical accelerometer bias inflated |

use super::Row;
use crate::filter::state::Rotation;
use crate::filter::{ATTITUDE, NominalState, POSITION};

/// The range a level `surface` (world down coordinate, m) should give. `rotation[2][2]` must be positive: the caller
/// has checked the tilt.
#[inline]
#[must_use]
pub fn range(state: &NominalState, rotation: &Rotation, surface: f32) -> Row {
    let [r31, r32, r33] = rotation[2];
    let inverse = 1.0 / r33;
    let predicted = (surface - state.position.z) * inverse;
    Row::new(
        predicted,
        [(POSITION + 2, -inverse), (ATTITUDE, predicted * r32 * inverse), (ATTITUDE + 1, -predicted * r31 * inverse)],
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jacobian_matches_numerical_differentiation() {
        crate::aid::numeric::check(|state| range(state, &state.rotation(), 0.05));
    }
}
