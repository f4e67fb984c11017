//! Magnetic heading: one row about the vertical, without the tilt.
//!
//! The measured field is turned into the world with the estimated attitude; the angle between its horizontal part and
//! the reference's is the heading error. A small body rotation θ turns the body by R·θ in the world; its vertical
//! component R₃₁θ_x + R₃₂θ_y + R₃₃θ_z is the heading change. Motor currents bend the field by more than any tilt, so
//! only this one row is used.
//!
//! | in [`Eskf`](crate::Eskf) | condition |
//! |---|---|
//! | start | `mag_enable` with [`MagModel::Heading`](crate::MagModel::Heading), a calibration with a field, 10 to 100 µT, a horizontal part above 1 µT |
//! | continue | the same, and a test ratio of at most one |
//! | stop | one of these fails: refused at once, inactive one second after the last accepted field |
//! | inflate | rejected for longer than `lockout`: the heading's variance grows, once per lock-out |
//! | reset | none: the heading is never set to the field |

use super::Row;
use crate::filter::ATTITUDE;
use crate::filter::state::{Rotation, rotate};
use stampfly_types::{Vec3, math};

/// Heading that the field measures, relative to the reference heading (zero in the true attitude), and its row.
/// `None` when the field has no usable horizontal part.
#[must_use]
pub fn error(rotation: &Rotation, field: &Vec3, reference: f32) -> Option<Row> {
    let world = rotate(rotation, field);
    let horizontal = world.x * world.x + world.y * world.y;
    // Less than 1 µT is no direction; neither is what is not a number.
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

    /// The row is exact for rotations about the vertical, which is all it claims.
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
