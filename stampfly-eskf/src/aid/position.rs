//! A position in the world's axes: measured from outside, or a pseudo-measurement.
//!
//! It is the state itself: z = p, so the Jacobian is the identity in the three position errors.
//!
//! A camera system's position, or the place of a stationary vehicle.
//!
//! | external position in [`Eskf`](crate::Eskf) | condition |
//! |---|---|
//! | start | initialised, finite, new, at most `horizon` old |
//! | continue | the same, and a joint test ratio of the axes given of at most one |
//! | stop | no condition of its own: inactive `aiding_timeout` after the last accepted sample |
//! | reset | rejected for longer than `external_lockout`: position to the sample, the surface with it; variance of position and velocity reset, attitude inflated |

use super::Row;
use crate::filter::{NominalState, POSITION};

/// Predicted position, world, m: the state's own.
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
