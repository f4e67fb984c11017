//! Optical flow over a level surface as horizontal velocity in the body frame.
//!
//! Flow as an angular rate, minus the body's own rotation, times the distance is the velocity along
//! body x and y. The reading is z = distance · (flow rate ∓ body rate), the prediction v_body =
//! Rᵀ·v. For a small body rotation θ, (R(I + \[θ\]×))ᵀ·v = v_b + \[v_b\]×·θ, which gives the
//! attitude columns; the velocity columns are the columns of R. The gyro bias enters through the
//! rotation that was subtracted: the rates are raw, ω_m = ω + b, so with the bias b the reading
//! along x is v_x − distance·b_y and the one along y is v_y + distance·b_x. The prediction has the
//! same terms.
//!
//! The distance is treated as known; its error is part of the measurement noise.
//!
//! Conditions in [`Eskf`](crate::Eskf):
//! - **Start**: valid, quality of at least `flow_min_quality`, an interval of 1 to 100 ms, tilt
//!   within `min_cos_tilt`, a known surface, a height whose standard deviation is below 0.1 m plus
//!   half the distance, a distance of at least 0.02 m, and in a commanded flight of at least
//!   `flow_min_distance` until it has once reached that.
//! - **Image motion**: refused in flight if the measured or the predicted motion exceeds
//!   `flow_max_rate` and the other one exceeds half of it, and during and after a turn above it.
//! - **Continue**: the same, and a joint test ratio of both axes of at most one.
//! - **Stop**: a condition fails, refused at once. Inactive one second after the last accepted
//!   sample.
//! - **Inflation**: the mean of the innovations is biased in flight. Tilt and horizontal gyro bias
//!   are inflated, the accelerometer bias is reset.
//! - **Considered, not corrected**: height, climb rate and vertical accelerometer bias; their
//!   uncertainty enters the innovation variance.
//! - **Reset**: rejected for longer than `lockout`. The horizontal velocity is set to the sample,
//!   then the same inflation.

use super::Row;
use crate::filter::state::{Rotation, rotate_back};
use crate::filter::{ATTITUDE, GYRO_BIAS, NominalState, VELOCITY};

/// Predicted velocity along body x and y, m/s; `distance` is the distance to the surface along the
/// beam, m.
#[inline]
#[must_use]
pub fn body_velocity(state: &NominalState, rotation: &Rotation, distance: f32) -> [Row; 2] {
    let v = rotate_back(rotation, &state.velocity);
    let [north, east, down] = rotation;
    let columns = |c: usize| [(VELOCITY, north[c]), (VELOCITY + 1, east[c]), (VELOCITY + 2, down[c])];
    let ([x0, x1, x2], [y0, y1, y2]) = (columns(0), columns(1));
    [
        Row::new(
            v.x - distance * state.gyro_bias.y,
            [x0, x1, x2, (ATTITUDE + 1, -v.z), (ATTITUDE + 2, v.y), (GYRO_BIAS + 1, -distance)],
        ),
        Row::new(
            v.y + distance * state.gyro_bias.x,
            [y0, y1, y2, (ATTITUDE, v.z), (ATTITUDE + 2, -v.x), (GYRO_BIAS, distance)],
        ),
    ]
}

/// The reading: flow rates and the *raw* body rates, averaged over the same interval, rad/s, times
/// the distance, m.
#[inline]
#[must_use]
pub fn measured_velocity(flow_rate: [f32; 2], raw_rate: [f32; 2], distance: f32) -> [f32; 2] {
    [(flow_rate[0] - raw_rate[1]) * distance, (flow_rate[1] + raw_rate[0]) * distance]
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn jacobian_matches_numerical_differentiation() {
        for axis in 0..2 {
            crate::aid::numeric::check(|state| body_velocity(state, &state.rotation(), 0.7)[axis]);
        }
    }

    #[test]
    fn pure_rotation_measures_no_velocity() {
        // Pitching up at 0.3 rad/s reads +0.3 in x, rolling right at 0.2 rad/s reads −0.2 in y.
        let measured = measured_velocity([0.3, -0.2], [0.2, 0.3], 0.5);
        assert!(measured.iter().all(|v| v.abs() < 1e-7));
    }

    #[test]
    fn a_gyro_bias_is_predicted_by_the_model() {
        // A stationary gyro reads its bias: the reading is −d·b_y in x, as predicted.
        let state = NominalState { gyro_bias: [0.02, 0.05, 0.0].into(), ..NominalState::default() };
        let rows = body_velocity(&state, &state.rotation(), 0.5);
        let measured = measured_velocity([0.0, 0.0], [0.02, 0.05], 0.5);
        assert_abs_diff_eq!(rows[0].predicted, measured[0], epsilon = 1e-7);
        assert_abs_diff_eq!(rows[1].predicted, measured[1], epsilon = 1e-7);
    }
}
