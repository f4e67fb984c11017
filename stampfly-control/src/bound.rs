//! Limits that cannot panic.
//!
//! `f32::clamp` panics when its bounds are crossed or no numbers, and the bounds here come from parameters that
//! somebody may have set wrongly. These keep the value instead: a wrong bound is then no bound. They are also a few
//! instructions shorter, because they leave NaN as it is for the caller to catch.

use stampfly_types::math::{larger, smaller};

/// The value, at least `low` and at most `high`. One comparison after the other, as vectors have them: of a value and a bound.
#[inline]
pub(crate) fn within(value: f32, low: f32, high: f32) -> f32 {
    let value = if value > high { high } else { value };
    if value < low { low } else { value }
}

/// The value, at most `limit` away from zero.
#[inline]
pub(crate) fn symmetric(value: f32, limit: f32) -> f32 {
    within(value, -limit, limit)
}

/// Collective thrust, N, from zero to `max` and to `ceiling`, a share of `hover`. No number is no thrust; a ceiling that is no
/// number limits nothing, because `min` takes the other one.
#[inline]
pub(crate) fn possible_thrust(thrust: f32, max: f32, ceiling: f32, hover: f32) -> f32 {
    let limit = larger(smaller(max, ceiling * hover), 0.0);
    if thrust.is_finite() { within(thrust, 0.0, limit) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ceiling_is_a_share_of_hover_thrust() {
        assert_eq!(possible_thrust(0.5, 0.6, 1.25, 0.3), 0.375);
        assert_eq!(possible_thrust(0.5, 0.6, -1.0, 0.3), 0.0);
        for unlimited in [f32::MAX, f32::INFINITY, f32::NAN] {
            assert_eq!(possible_thrust(0.9, 0.6, unlimited, 0.3), 0.6);
        }
        assert_eq!(possible_thrust(f32::NAN, 0.6, f32::MAX, 0.3), 0.0);
    }

    #[test]
    fn wrong_bounds_do_not_panic() {
        assert_eq!(within(2.0, 0.0, 1.0), 1.0);
        assert_eq!(symmetric(-2.0, 1.0), -1.0);
        assert_eq!(symmetric(2.0, f32::NAN), 2.0);
        assert_eq!(within(0.5, 1.0, 0.0), 1.0, "crossed bounds: one of them");
        assert!(within(f32::NAN, 0.0, 1.0).is_nan());
    }
}
