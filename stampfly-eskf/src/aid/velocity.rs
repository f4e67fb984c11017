//! A velocity that is measured from outside, or simply known, in the world's axes.
//!
//! It is the state itself: z = v, so the Jacobian is the identity in the three velocity errors.
//!
//! A camera system's velocity, the zero of a vehicle that stands, or what is assumed of one that is carried
//! out of sight of everything.

use super::Row;
use crate::filter::{Nominal, VELOCITY};

/// Predicted velocity, world, m/s: the state's own.
#[inline]
#[must_use]
pub fn world(state: &Nominal) -> [Row; 3] {
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
