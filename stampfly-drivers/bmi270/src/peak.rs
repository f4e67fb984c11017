//! The largest specific force of a group of chip samples that cannot be one sample's noise.
//!
//! A decimation filter spreads a blow over two outputs and shows a third of it in the first. What the chip itself measured shows all of
//! it at once, but single chip samples are full of the propellers' shaking, and one flipped bit is a peak as well. So three
//! samples running have to agree: of each axis counts what all three have on the same side of zero. For whoever has to see a blow in the
//! sample in which it begins. Not a measurement of its size, and no input for an estimator.

/// Samples running that have to agree: at 1600 Hz a wall at 1 m/s pushes for 8 of them, and the force of a rotor at hover (478 Hz)
/// changes its side within two.
const AGREE: usize = 3;

/// Finds the peak in groups of four.
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
    /// The last samples of the group before; zero agrees with nothing.
    before: [[i16; 3]; AGREE - 1],
}

impl Peak {
    /// Takes four samples of which the first three channels are an accelerometer's; gives the length of what three running have in
    /// common, where that is largest, in counts.
    #[must_use]
    pub fn push(&mut self, group: &[[i16; 6]; 4]) -> f32 {
        let [first, second, third, fourth] = group.map(|[x, y, z, ..]| [x, y, z]);
        let [older, old] = core::mem::replace(&mut self.before, [third, fourth]);
        let runs = [[older, old, first], [old, first, second], [first, second, third], [second, third, fourth]];
        let largest = runs.iter().map(common_square).max().unwrap_or_default();
        root(largest)
    }
}

/// The square root of the `f32` nearest to this integer, to the last bit.
///
/// Digit by digit and in 32 bits, so that the driver needs no library of mathematics, and a small processor no division. With d the digit that
/// is tried and r the root so far, r + d is kept while (r + d)² is not above the square; what is left of it, doubled for each digit, says so.
fn root(square: u32) -> f32 {
    if square == 0 {
        return 0.0;
    }
    let bits = (square as f32).to_bits();
    let exponent = (bits >> 23) - 127;
    // The mantissa with its first bit, and an even exponent.
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
    // One digit more than an `f32` has: it rounds.
    let rounded = (root + (root & 1)) >> 1;
    f32::from_bits(rounded - 0x0080_0000 + ((127 + exponent / 2) << 23))
}

/// The square of what three samples have in common: of each axis what is nearest to zero, if all are on one side of it. At most 3·2³⁰.
fn common_square(run: &[[i16; 3]; AGREE]) -> u32 {
    let [a, b, c] = run;
    let axis = |axis: usize| {
        let [a, b, c] = [a, b, c].map(|sample| i32::from(sample[axis]));
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
