//! An attitude that is measured from outside: motion capture, a second estimator.
//!
//! The error between the estimate q and the measurement q_m is q⁻¹ ⊗ q_m = (1, θ/2) for a small body rotation θ.
//! The reading is that θ, the prediction zero; correcting the state by θ takes it away, so the Jacobian is the identity
//! in the attitude errors. Its length is the sine, not the angle, of the error: within 2 % to 0.35 rad, and
//! always of the right sign.
//!
//! | external attitude in [`Eskf`](crate::Eskf) | condition |
//! |---|---|
//! | start | initialised, finite, new, at most `horizon` old |
//! | continue | the same, and a joint test ratio of the three axes of at most one |
//! | stop | no condition of its own: inactive one second after the last accepted sample |
//! | reset | rejected for longer than `external_lockout`: attitude to the sample, history emptied; its variance reset, velocity and gyro bias inflated |

use super::Row;
use crate::filter::ATTITUDE;
use crate::filter::state::multiply;
use stampfly_types::Vec3;

/// Rotation from the attitude `estimated` to the attitude `measured` (both w, x, y, z), body, rad.
#[inline]
#[must_use]
pub fn error(estimated: [f32; 4], measured: [f32; 4]) -> Vec3 {
    let [w, x, y, z] = estimated;
    let [w, x, y, z] = multiply([w, -x, -y, -z], measured);
    // A quaternion and its negative are the same attitude: take the short way.
    let sign = if w < 0.0 { -2.0 } else { 2.0 };
    Vec3::new(x, y, z) * sign
}

/// The rows for the three axes of that rotation: predicted to be zero.
#[inline]
#[must_use]
pub fn rows() -> [Row; 3] {
    let axis = |i: usize| Row::new(0.0, [(ATTITUDE + i, 1.0)]);
    [axis(0), axis(1), axis(2)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aid::numeric::awkward_state;
    use crate::filter::N;

    #[test]
    fn jacobian_matches_numerical_differentiation() {
        let state = awkward_state();
        let mut by = [0.0; N];
        by[ATTITUDE..ATTITUDE + 3].copy_from_slice(&[0.01, -0.02, 0.015]);
        let mut moved = state;
        moved.correct(&by);
        // The attitude of the moved state differs by just that much, for either sign of the quaternion.
        for sign in [1.0, -1.0] {
            let error = error(state.attitude, moved.attitude.map(|v| sign * v));
            for axis in 0..3 {
                let stated = rows()[axis].jacobian[ATTITUDE + axis] * by[ATTITUDE + axis];
                assert!((error[axis] - stated).abs() < 1e-5, "{error:?}");
            }
        }
    }
}
