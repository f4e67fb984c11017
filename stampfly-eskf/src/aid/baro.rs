//! Barometric altitude as vertical position.
//!
//! h = −p_z + offset, so the only derivative is −1. Pressure drifts by metres an hour and jumps in propeller wash;
//! the offset is tracked by the filter while a better height is at hand, and the model is used when it is not.

use super::Row;
use crate::filter::{Nominal, POSITION};

/// Predicted altitude for an altitude `offset` of the origin, m.
#[inline]
#[must_use]
pub fn altitude(state: &Nominal, offset: f32) -> Row<1> {
    Row { predicted: offset - state.position.z, jacobian: [(POSITION + 2, -1.0)] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jacobian_matches_numerical_differentiation() {
        crate::aid::numeric::check(|state| altitude(state, 12.0));
    }
}
