//! Position in world axes: measured from outside, or a pseudo-measurement.
//!
//! z = p, so the Jacobian is the identity in the three position errors. Used for camera systems,
//! satellite receivers and the known place of a stationary vehicle.
//!
//! Conditions for external positions in [`Eskf`](crate::Eskf):
//! - **Start**: initialised, finite, new, at most `horizon` old.
//! - **Continue**: the same, and a joint test ratio of the measured axes of at most one.
//! - **Stop**: no further condition. Inactive `aiding_timeout` after the last accepted sample.
//! - **Reset**: rejected for longer than `external_lockout`. The position is set to the sample and
//!   the surface moves with it; the variances of position and velocity are reset, the attitude is
//!   inflated.
//! - **Unknown position or heading**: the position is set to the sample.

use super::Row;
use crate::filter::{NominalState, POSITION};

/// Predicted position, world, m: that of the state.
#[inline]
#[must_use]
pub fn world(state: &NominalState) -> [Row; 3] {
    let axis = |i: usize| Row::new(state.position[i], [(POSITION + i, 1.0)]);
    [axis(0), axis(1), axis(2)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jacobian_matches_numerical_differentiation() {
        for axis in 0..3 {
            crate::aid::numeric::check(|state| world(state)[axis]);
        }
    }
}
