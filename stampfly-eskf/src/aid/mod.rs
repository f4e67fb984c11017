//! Measurement models, one per file: the predicted reading of a sensor and its derivatives by the
//! state.
//!
//! A model returns [`Row`]s: the predicted reading and the Jacobian with respect to the fifteen
//! error states. Each file derives its Jacobian, tests it against numerical differentiation, and
//! lists the conditions under which [`Eskf`](crate::Eskf) starts, continues, stops and resets with
//! the sensor. In addition, every measurement must be finite, newer than the sensor's last one, at
//! most [`horizon`](crate::EskfConfig::horizon) old and at most 0.02 s ahead of the last inertial
//! sample.

pub mod airspeed;
pub mod attitude;
pub mod baro;
pub mod drag;
pub mod field;
pub mod flow;
pub mod gravity;
pub mod heading;
pub mod position;
pub mod tof;
pub mod velocity;

use crate::filter::N;

/// One scalar row of a measurement model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Predicted reading of the sensor.
    pub predicted: f32,
    /// Derivative of the prediction by each error state. Most entries are zero.
    pub jacobian: [f32; N],
}

impl Row {
    /// A row from the non-zero entries of its Jacobian, as (state index, value). Entries with an
    /// index out of range are ignored.
    #[inline]
    #[must_use]
    pub fn new<const K: usize>(predicted: f32, entries: [(usize, f32); K]) -> Self {
        let mut jacobian = [0.0; N];
        for (state, value) in entries {
            if let Some(cell) = jacobian.get_mut(state) {
                *cell = value;
            }
        }
        Self { predicted, jacobian }
    }
}

#[cfg(test)]
pub(crate) mod numeric {
    //! Numerical check of Jacobians.
    use super::Row;
    use crate::filter::{N, NominalState};
    use stampfly_types::Vec3;

    /// A state without symmetries.
    pub fn awkward_state() -> NominalState {
        let mut state = NominalState {
            position: Vec3::new(0.3, -0.2, -0.8),
            velocity: Vec3::new(0.4, -0.3, 0.2),
            gyro_bias: Vec3::new(0.01, -0.02, 0.03),
            accel_bias: Vec3::new(0.1, 0.05, -0.1),
            ..NominalState::default()
        };
        let mut turn = [0.0; N];
        turn[6..9].copy_from_slice(&[0.2, -0.25, 0.7]);
        state.correct(&turn);
        state
    }

    /// Compares a row with central differences over all fifteen states.
    pub fn check(model: impl Fn(&NominalState) -> Row) {
        let state = awkward_state();
        let row = model(&state);
        for i in 0..N {
            let step = 1e-2;
            let shifted = |sign: f32| {
                let mut by = [0.0; N];
                by[i] = sign * step;
                let mut moved = state;
                moved.correct(&by);
                model(&moved).predicted
            };
            let numeric = (shifted(1.0) - shifted(-1.0)) / (2.0 * step);
            let stated = row.jacobian[i];
            assert!((numeric - stated).abs() < 2e-3, "state {i}: numeric {numeric}, stated {stated}");
        }
    }
}
