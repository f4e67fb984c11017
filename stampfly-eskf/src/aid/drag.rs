//! Drag of a multirotor as a measurement of the velocity along body x and y.
//!
//! Propellers push along body z. The specific force along x and y is the drag of rotors and body,
//! proportional to the airspeed in slow flight: f = −k·v + b, with k in 1/s (P. Martin and E.
//! Salaün, "The True Role of Accelerometer Feedback in Quadrotor Control", ICRA 2010; R. Leishman
//! et al., "Quadrotors and Accelerometers", IEEE Control Systems 34(1), 2014). The derivatives are
//! those of the velocity in body axes.
//!
//! Use it for flight without any measured velocity: it bounds the drift of the velocity. Wind is an
//! error of the reading, so the vehicle drifts with the wind. Not valid while the propellers do not
//! carry the body.
//!
//! Conditions in [`Eskf`](crate::Eskf), every fourth sample, without a gate:
//! - **Start**: `drag` above zero, commanded `flying`, accelerometer in use, velocity not measured.
//! - **Stop**: flow, external velocity or position was accepted within the last second, or the
//!   vehicle no longer flies.

use super::Row;
use crate::filter::state::Rotation;
use crate::filter::{ACCEL_BIAS, NominalState};

/// Predicted specific force along body x and y, m/s², for the drag coefficient `drag`, 1/s.
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
