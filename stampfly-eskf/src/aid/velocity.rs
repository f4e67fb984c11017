//! A velocity in the world's axes: measured from outside, or a pseudo-measurement.
//!
//! It is the state itself: z = v, so the Jacobian is the identity in the three velocity errors.
//!
//! A camera system's velocity, the zero of a stationary vehicle (ZUPT), or the assumption for one that is carried
//! out of sight of everything.
//!
//! | external velocity in [`Eskf`](crate::Eskf) | condition |
//! |---|---|
//! | start | initialised, finite, new, at most `horizon` old |
//! | continue | the same, and a joint test ratio of the axes given of at most one |
//! | stop | no condition of its own: inactive `aiding_timeout` after the last accepted sample |
//! | reset | rejected for longer than `external_lockout`: velocity to the sample; its variance reset, attitude inflated |

use super::Row;
use crate::filter::state::rotate_back;
use crate::filter::{ATTITUDE, NominalState, VELOCITY};

/// Predicted velocity, world, m/s: the state's own.
#[inline]
#[must_use]
pub fn world(state: &NominalState) -> [Row; 3] {
    let axis = |i: usize| Row::new(state.velocity[i], [(VELOCITY + i, 1.0)]);
    [axis(0), axis(1), axis(2)]
}

/// Predicted velocity in the body, m/s: what wheels measure along x, and what neither a wheel
/// nor a plane has along y. For [`Eskf::fuse`](crate::Eskf::fuse).
///
/// v_b = Rᵀ·v; a small rotation θ of the body gives v_b + \[v_b\]×·θ.
#[inline]
#[must_use]
pub fn body(state: &NominalState) -> [Row; 3] {
    let rotation = state.rotation();
    let v = rotate_back(&rotation, &state.velocity);
    let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = rotation;
    let row = |speed, [a, b, c]: [f32; 3], [x, y, z]: [f32; 3]| {
        let by_attitude = [(ATTITUDE, x), (ATTITUDE + 1, y), (ATTITUDE + 2, z)];
        let [x, y, z] = by_attitude;
        Row::new(speed, [(VELOCITY, a), (VELOCITY + 1, b), (VELOCITY + 2, c), x, y, z])
    };
    [
        row(v.x, [xx, yx, zx], [0.0, -v.z, v.y]),
        row(v.y, [xy, yy, zy], [v.z, 0.0, -v.x]),
        row(v.z, [xz, yz, zz], [-v.y, v.x, 0.0]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jacobian_matches_numerical_differentiation() {
        for axis in 0..3 {
            crate::aid::numeric::check(|state| world(state)[axis]);
            crate::aid::numeric::check(|state| body(state)[axis]);
        }
    }
}
