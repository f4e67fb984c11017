//! Maximum and minimum of two numbers with the same result on every target.
//!
//! `f32::max` and `f32::min` are calls of ten instructions on cores whose FPU has a comparison but
//! no selection, such as the Cortex-M4F, and the target chooses which of two zeros they return. Use
//! these functions in flight code; in tools the standard library's are fine.

/// The larger of two numbers; the second when both are equal. Ignores a NaN unless both are.
///
/// ```
/// use stampfly_types::math::larger;
/// assert_eq!(larger(1.0, 2.0), 2.0);
/// assert_eq!((larger(f32::NAN, 2.0), larger(1.0, f32::NAN)), (2.0, 1.0));
/// ```
#[inline]
#[must_use]
pub const fn larger(a: f32, b: f32) -> f32 {
    if a > b || b.is_nan() { a } else { b }
}

/// The smaller of two numbers; the second when both are equal. Ignores a NaN unless both are.
///
/// ```
/// use stampfly_types::math::smaller;
/// assert_eq!(smaller(1.0, 2.0), 1.0);
/// assert_eq!((smaller(f32::NAN, 2.0), smaller(1.0, f32::NAN)), (2.0, 1.0));
/// ```
#[inline]
#[must_use]
pub const fn smaller(a: f32, b: f32) -> f32 {
    if a < b || b.is_nan() { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn they_are_what_the_language_has_except_for_which_zero(a: f32, b: f32) {
            for (ours, theirs) in [(larger(a, b), a.max(b)), (smaller(a, b), a.min(b))] {
                prop_assert!(ours == theirs || ours.is_nan() && theirs.is_nan(), "{a} {b}: {ours} {theirs}");
            }
        }
    }

    #[test]
    fn of_two_zeros_the_second_comes_out_everywhere() {
        for (a, b) in [(0.0f32, -0.0f32), (-0.0, 0.0)] {
            assert_eq!([larger(a, b), smaller(a, b)].map(f32::to_bits), [b.to_bits(); 2]);
        }
    }
}
