//! Limits that cannot panic.
//!
//! `f32::clamp` panics when its bounds are crossed or no numbers, and the bounds here come from parameters that
//! somebody may have set wrongly. These keep the value instead: a wrong bound is then no bound. They are also a few
//! instructions shorter, because they leave NaN as it is for the caller to catch.

use stampfly_types::math::{self, larger, smaller};

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

/// Slope of the lean that is left when the thrust does not suffice: 15° cost 3.5 % of it.
const TAN_LEAN_MIN: f32 = 0.268;
/// Slope that is no limit: 89.9°.
const TAN_ANY: f32 = 1e3;

/// Tangent of the largest lean at which `available`, N, still has `needed`, N, as its upward part: height
/// comes before place. Not less than 15°, and [`TAN_ANY`] where nothing is needed.
pub(crate) fn tan_lean_max(available: f32, needed: f32) -> f32 {
    if needed <= 0.0 {
        return TAN_ANY;
    }
    let ratio = smaller(available / needed, TAN_ANY);
    larger(math::sqrt(larger(ratio * ratio - 1.0, 0.0)), TAN_LEAN_MIN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lean_leaves_the_thrust_that_is_needed_upwards() {
        for available in [0.4, 0.5, 0.6] {
            let cos = math::cos(math::atan2(tan_lean_max(available, 0.36), 1.0));
            assert!((available * cos - 0.36).abs() < 1e-3, "{available} N");
        }
        assert_eq!(tan_lean_max(0.3, 0.36), TAN_LEAN_MIN, "what is left without enough of it");
        assert_eq!(tan_lean_max(0.6, 0.0), TAN_ANY, "a throttle stick asks for nothing upwards");
    }

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
