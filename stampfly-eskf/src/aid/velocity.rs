//! Velocity in world or body axes: measured from outside, or a pseudo-measurement.
//!
//! In world axes z = v, so the Jacobian is the identity in the three velocity errors. Used for
//! camera systems, satellite receivers, the zero-velocity update (ZUPT) of a stationary vehicle,
//! and the assumption for a vehicle without aiding.
//!
//! Conditions for external velocities in [`Eskf`](crate::Eskf):
//! - **Start**: initialised, finite, new, at most `horizon` old.
//! - **Continue**: the same, and a joint test ratio of the measured axes of at most one.
//! - **Stop**: no further condition. Inactive `aiding_timeout` after the last accepted sample.
//! - **Reset**: rejected for longer than `external_lockout`. The velocity is set to the sample; its
//!   variance is reset, the attitude is inflated.
//! - **Unknown heading**: horizontal velocities are used to find the heading, not fused.

use super::Row;
use crate::filter::state::rotate_back;
use crate::filter::{ATTITUDE, NominalState, VELOCITY};

/// Predicted velocity, world, m/s: that of the state.
#[inline]
#[must_use]
pub fn world(state: &NominalState) -> [Row; 3] {
    let axis = |i: usize| Row::new(state.velocity[i], [(VELOCITY + i, 1.0)]);
    [axis(0), axis(1), axis(2)]
}

/// Predicted velocity in body axes, m/s, for [`Eskf::fuse`](crate::Eskf::fuse): wheels measure it
/// along x; wheels and planes have none along y.
///
/// v_b = Rᵀ·v; a small body rotation θ gives v_b + \[v_b\]×·θ.
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
