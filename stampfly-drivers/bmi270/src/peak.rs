//! The largest specific force on which several consecutive samples of the chip agree.
//!
//! The decimation filter spreads an impact over two outputs and shows a third of it in the first.
//! The chip's own samples show all of it at once, but a single sample may be noise of the
//! propellers or a flipped bit. Three consecutive samples therefore have to agree: on each axis,
//! the part counts that all three have on the same side of zero.
//!
//! For detecting an impact in the sample in which it begins. It does not measure the size of the
//! impact, and it is not an input for an estimator.

/// Number of consecutive samples that have to agree. At 1600 Hz a wall hit at 1 m/s acts for 8 of
/// them, while the force of a rotor at hover (478 Hz) changes its sign within two.
const AGREE: usize = 3;

/// Finds the peak in groups of four samples.
///
/// ```
/// use stampfly_bmi270::Peak;
/// let mut peak = Peak::default();
/// let [still, struck] = [[0, 0, -4096, 0, 0, 0], [20_000, 0, 0, 0, 0, 0]];
/// assert_eq!(peak.push(&[still; 4]), 4096.0);
/// assert_eq!(peak.push(&[still, still, struck, struck]), 4096.0, "two samples");
/// assert_eq!(peak.push(&[struck, still, still, still]), 20_000.0, "the third");
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Peak {
    /// Last samples of the previous group. Zeros, which agree with no sample, before the first
    /// group.
    before: [[i16; 3]; AGREE - 1],
}

impl Peak {
    /// Takes four samples, the first three channels of which are the accelerometer's. Returns, in
    /// counts, the largest length of the vector that three consecutive samples have in common.
    #[must_use]
    pub fn push(&mut self, group: &[[i16; 6]; 4]) -> f32 {
        let [first, second, third, fourth] = group.map(|[x, y, z, ..]| [x, y, z]);
        // Runs of three that cross the boundary of two groups need the last two samples.
        let [older, old] = core::mem::replace(&mut self.before, [third, fourth]);
        let runs = [[older, old, first], [old, first, second], [first, second, third], [second, third, fourth]];
        let largest = runs.iter().map(common_square).max().unwrap_or_default();
        root(largest)
    }
}

/// The square root of the `f32` nearest to this integer, correctly rounded.
///
/// Computes digit by digit in 32 bits, so that the driver needs no maths library and a small
/// processor no division. With the tried digit d and the root r so far, r + d is kept while (r +
/// d)² is not above the square. The comparison uses the remainder, which is doubled for each digit.
fn root(square: u32) -> f32 {
    if square == 0 {
        return 0.0;
    }
    let bits = (square as f32).to_bits();
    let exponent = (bits >> 23) - 127;
    // The mantissa with its leading bit, scaled to an even exponent.
    let mut left = (bits & 0x007F_FFFF | 0x0080_0000) << (1 + exponent % 2);
    let (mut root, mut doubled, mut digit) = (0, 0, 1_u32 << 24);
    while digit > 0 {
        let tried = doubled + digit;
        if tried <= left {
            doubled = tried + digit;
            left -= tried;
            root += digit;
        }
        left <<= 1;
        digit >>= 1;
    }
    // One digit more than an `f32` has, for rounding.
    let rounded = (root + (root & 1)) >> 1;
    f32::from_bits(rounded - 0x0080_0000 + ((127 + exponent / 2) << 23))
}

/// The square of the vector that three samples have in common: on each axis the value nearest to
/// zero if all are on one side of it, else zero. At most 3·2³⁰.
fn common_square(run: &[[i16; 3]; AGREE]) -> u32 {
    let [a, b, c] = run;
    let axis = |axis: usize| {
        let [a, b, c] = [a, b, c].map(|sample| i32::from(sample[axis]));
        // At most one of the two terms is not zero: the smallest value if all are positive, or the
        // largest if all are negative.
        let common = a.min(b).min(c).max(0) + a.max(b).max(c).min(0);
        (common * common).unsigned_abs()
    };
    axis(0) + axis(1) + axis(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::math;

    fn peaks(groups: [[[i16; 3]; 4]; 2]) -> [f32; 2] {
        let mut peak = Peak::default();
        groups.map(|group| peak.push(&group.map(|[x, y, z]| [x, y, z, i16::MAX, i16::MIN, 0])))
    }

    #[test]
    fn three_samples_across_two_groups_agree() {
        let still = [0, 0, -4096];
        let [left, right] = [[-30_000, 3, 0], [-20_000, 4, 9]];
        assert_eq!(peaks([[still, still, left, right], [[-25_000, -9, 9], still, still, still]]), [0.0, 20_000.0]);
        assert_eq!(peaks([[left; 4], [[0, 3, 4]; 4]])[1], 5.0, "and are forgotten");
    }

    #[test]
    fn what_changes_its_side_is_no_peak() {
        let [there, back] = [[i16::MAX; 3], [i16::MIN; 3]];
        assert_eq!(peaks([[there, back, there, back], [there, back, there, back]]), [0.0; 2]);
        assert_eq!(peaks([[back; 4]; 2]), [32_768.0 * math::sqrt(3.0); 2], "full scale overflows nothing");
    }

    #[test]
    fn the_first_group_agrees_with_nothing_before_it() {
        assert_eq!(peaks([[[7, 0, 0], [1, 0, 0], [1, 0, 0], [0; 3]], [[0; 3]; 4]]), [1.0, 0.0]);
    }

    #[test]
    fn roots_are_those_of_floating_point_to_the_last_bit() {
        let largest = 3 * (1u32 << 30);
        let some =
            (0..100_000).chain((0..100_000).map(|n| n * 32_212)).chain((0..56_000_u32).map(|n| n * n)).chain([largest]);
        for square in some.chain((0..100_000).map(|n| largest - n)) {
            assert_eq!(root(square).to_bits(), math::sqrt(square as f32).to_bits(), "{square}");
        }
    }
}
