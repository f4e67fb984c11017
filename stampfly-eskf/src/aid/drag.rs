//! A multirotor's drag, as the velocity along body x and y through still air.
//!
//! Propellers push along the body's z. What the accelerometer feels along x and y is the air's drag on rotors and
//! body, for slow flight in proportion to the velocity: f = −k·v + b, with k in 1/s (P. Martin and E. Salaün, "The True Role of
//! Accelerometer Feedback in Quadrotor Control", ICRA 2010; R. Leishman et al., "Quadrotors and Accelerometers", IEEE Control
//! Systems 34(1), 2014). The derivatives are those of the velocity in the body's axes.
//!
//! For flight without any measured velocity: it shows which way the vehicle drifts, and that it does not. Wind is an error of
//! the reading, so in wind the vehicle drifts with it. Not for a body whose propellers stand still, or do not carry it.
//!
//! | in [`Eskf`](crate::Eskf) | condition |
//! |---|---|
//! | start | `drag` above zero, told to be `flying`, nothing holds the velocity; every fourth sample |
//! | continue | the same; it is not gated |
//! | stop | flow, velocity or position was accepted within the last second, or it no longer flies |

use super::Row;
use crate::filter::state::Rotation;
use crate::filter::{ACCEL_BIAS, NominalState};

/// Predicted specific force along body x and y of a multirotor that loses `drag` of its velocity each second, 1/s.
#[inline]
#[must_use]
pub fn specific_force(state: &NominalState, rotation: &Rotation, drag: f32) -> [Row; 2] {
    let mut rows = super::flow::body_velocity(state, rotation, 0.0);
    for (axis, row) in rows.iter_mut().enumerate() {
        row.predicted = state.accel_bias[axis] - drag * row.predicted;
        row.jacobian = row.jacobian.map(|derivative| -drag * derivative);
        row.jacobian[ACCEL_BIAS + axis] = 1.0;
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jacobian_matches_numerical_differentiation() {
        for axis in 0..2 {
            crate::aid::numeric::check(|state| specific_force(state, &state.rotation(), 0.4)[axis]);
        }
    }
}
