//! Range to a level surface, along body z.
//!
//! With the surface at the down coordinate `surface`, the beam of a tilted body meets it at d =
//! (surface − p_z) / R₃₃. Derivatives: ∂d/∂p_z = −1/R₃₃. A small body rotation θ changes R₃₃ by
//! R₃₁·θ_y − R₃₂·θ_x, therefore ∂d/∂θ_x = d·R₃₂/R₃₃ and ∂d/∂θ_y = −d·R₃₁/R₃₃.
//!
//! Not for walls, stairs or a beam in another direction.
//!
//! Conditions in [`Eskf`](crate::Eskf):
//! - **Start**: a valid range within `tof_min` to `tof_max`, tilt within `min_cos_tilt`. The first
//!   range in flight defines the surface.
//! - **Continue**: the same, and a test ratio of at most one. On the ground it measures the
//!   surface, not the height.
//! - **Stop**: invalid, out of range or tilted, refused at once. Inactive one second after the last
//!   accepted range.
//! - **Reset**: rejected for longer than `lockout`. The height is set to the range; the variances
//!   of height and climb rate are reset, the vertical accelerometer bias is inflated.
//!   If the first rejected range had jumped, the surface is moved instead of the vehicle.

use super::Row;
use crate::filter::state::Rotation;
use crate::filter::{ATTITUDE, NominalState, POSITION};

/// Predicted range to a level `surface` (world down coordinate, m). `rotation[2][2]` must be
/// positive; the caller checks the tilt.
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
