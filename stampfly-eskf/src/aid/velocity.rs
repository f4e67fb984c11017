//! A velocity in the world's axes: measured from outside, or a pseudo-measurement.
//!
//! It is the state itself: z = v, so the Jacobian is the identity in the three velocity errors.
//!
//! A camera system's velocity, the zero of a stationary vehicle (ZUPT), or the assumption for one that is carried
//! out of sight of everything.
//!
//! | external velocity in [`Eskf`](crate::Eskf) | condition |
//! |---|---|
//! | start | initialised, finite, new, at most 0.1 s old |
//! | continue | the same, and a joint test ratio of the three axes of at most one |
//! | stop | no condition of its own: inactive one second after the last accepted sample |
//! | reset | rejected for longer than `lockout`: velocity to the sample; its variance reset, attitude inflated |

use super::Row;
use crate::filter::{NominalState, VELOCITY};

/// Predicted velocity, world, m/s: the state's own.
#[inline]
#[must_use]
pub fn world(state: &NominalState) -> [Row; 3] {
    let axis = |i: usize| Row::new(state.velocity[i], [(VELOCITY + i, 1.0)]);
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
