//! Magnetic heading: one row about the vertical, without the tilt.
//!
//! The measured field is rotated into the world with the estimated attitude; the angle between its
//! horizontal part and that of the reference is the heading error. A small body rotation θ rotates
//! the body by R·θ in the world; the vertical component R₃₁θ_x + R₃₂θ_y + R₃₃θ_z is the change of
//! heading. Motor currents distort the field by more than any tilt, so only this row is used. Where
//! the field is not distorted, [`field`](super::field) uses all three axes.
//!
//! Conditions in [`Eskf`](crate::Eskf):
//! - **Start**: `mag_enable` with [`MagModel::Heading`](crate::MagModel::Heading), a calibration
//!   with a field, 10 to 100 µT, a horizontal component above 1 µT.
//! - **Continue**: the same, and a test ratio of at most one.
//! - **Stop**: a condition fails, refused at once. Inactive one second after the last accepted
//!   field.
//! - **Inflation**: rejected for longer than `lockout`. The heading variance grows, once per
//!   lock-out.
//! - **Reset**: none. The heading is never set to the field.

use super::Row;
use crate::filter::ATTITUDE;
use crate::filter::state::{Rotation, rotate};
use stampfly_types::{Vec3, math};

/// Measured heading relative to the heading `reference` (rad), and its row; zero with the true
/// attitude. `None` if the horizontal component is NaN or at most 1 µT. `field` is in body axes,
/// µT.
#[must_use]
pub fn error(rotation: &Rotation, field: &Vec3, reference: f32) -> Option<Row> {
    let world = rotate(rotation, field);
    let horizontal = world.x * world.x + world.y * world.y;
    // The direction of less than 1 µT is noise. Written so that NaN is refused, too.
    if horizontal.is_nan() || horizontal <= 1.0 {
        return None;
    }
    let [r31, r32, r33] = rotation[2];
    Some(Row::new(
        math::wrap_angle(math::atan2(world.y, world.x) - reference),
        [(ATTITUDE, r31), (ATTITUDE + 1, r32), (ATTITUDE + 2, r33)],
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::state::rotate_back;
    use crate::filter::{N, NominalState};

    /// The row is exact only for rotations about the vertical, so only those are tested.
    #[test]
    fn jacobian_matches_a_turn_about_the_vertical() {
        let state = crate::aid::numeric::awkward_state();
        let field = rotate_back(&state.rotation(), &Vec3::new(22.0, -9.0, 38.0));
        let at = |state: &NominalState| error(&state.rotation(), &field, 0.1).expect("a field").predicted;
        let row = error(&state.rotation(), &field, 0.1).expect("a field");
        let axis = rotate_back(&state.rotation(), &Vec3::z());
        let step = 0.01;
        let mut turn = [0.0; N];
        for i in 0..3 {
            turn[ATTITUDE + i] = step * axis[i];
        }
        let mut moved = state;
        moved.correct(&turn);
        let stated: f32 = (0..3).map(|i| row.jacobian[ATTITUDE + i] * axis[i]).sum();
        assert!(((at(&moved) - at(&state)) / step - stated).abs() < 1e-3);
    }
}
