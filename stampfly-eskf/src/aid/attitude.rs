//! Attitude measured from outside: motion capture or a second estimator.
//!
//! For a small body rotation θ between the estimate q and the measurement q_m, q⁻¹ ⊗ q_m = (1,
//! θ/2). The reading is θ, the prediction is zero, and a correction by θ removes the difference, so
//! the Jacobian is the identity in the attitude errors. The length of the reading is twice the sine
//! of half the error, not the error: within 2 % up to 0.35 rad, and always of the right sign.
//!
//! Conditions in [`Eskf`](crate::Eskf):
//! - **Start**: initialised, finite, new, at most `horizon` old.
//! - **Continue**: the same, and a joint test ratio of the three axes of at most one.
//! - **Stop**: no further condition. Inactive one second after the last accepted sample.
//! - **Reset**: rejected for longer than `external_lockout`, and at the first sample while the
//!   heading is unknown. The attitude is set to the sample, the history is cleared, the attitude
//!   variance is reset, velocity and gyro bias are inflated.

use super::Row;
use crate::filter::ATTITUDE;
use crate::filter::state::multiply;
use stampfly_types::Vec3;

/// Rotation vector from attitude `estimated` to attitude `measured` (both w, x, y, z), body axes,
/// rad.
#[inline]
#[must_use]
pub fn error(estimated: [f32; 4], measured: [f32; 4]) -> Vec3 {
    let [w, x, y, z] = estimated;
    let [w, x, y, z] = multiply([w, -x, -y, -z], measured);
    // A quaternion and its negative are the same attitude: choose the shorter rotation.
    let sign = if w < 0.0 { -2.0 } else { 2.0 };
    Vec3::new(x, y, z) * sign
}

/// Rows of the three axes of that rotation, with prediction zero.
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
        // The error equals the applied rotation, for either sign of the quaternion.
        for sign in [1.0, -1.0] {
            let error = error(state.attitude, moved.attitude.map(|v| sign * v));
            for axis in 0..3 {
                let stated = rows()[axis].jacobian[ATTITUDE + axis] * by[ATTITUDE + axis];
                assert!((error[axis] - stated).abs() < 1e-5, "{error:?}");
            }
        }
    }
}
