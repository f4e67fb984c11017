//! Square root from multiplications, for cores without an instruction for it that a library can name.
//!
//! Its bits are those of `libm`: the root, rounded to the nearest. It takes 40 instructions instead of 50 on an ARM core, and 40
//! instead of 280 on an Xtensa core, whose compiler makes a call of each wide product. Not for machines where `libm` itself uses the
//! machine's instruction: x86, AArch64, WebAssembly.

/// Below this the inverse root's steps would meet subnormal numbers, above it the square of a root overflows: 2⁻¹⁰⁰ and 2¹²⁶.
const SMALLEST: u32 = (127 - 100) << 23;
const LARGEST: u32 = (127 + 126) << 23;

/// First guess of an inverse root, to 3.5 %: half of the number's logarithm, with the constant of C. Lomont, "Fast Inverse Square
/// Root", 2003, that is best before two steps of Newton's.
const GUESS: u32 = 0x5f37_5a86;

/// Bits of a number's fraction, and the one that is not written down.
const FRACTION: u32 = (1 << 23) - 1;
const HIDDEN: u32 = 1 << 23;

/// Square root, rounded to the nearest. NaN for negative numbers.
// Forty instructions that are wanted in many places, some of them in fast memory.
#[inline(never)]
#[must_use]
pub fn sqrt(value: f32) -> f32 {
    let bits = value.to_bits();
    if !(SMALLEST..LARGEST).contains(&bits) {
        return libm::sqrtf(value);
    }
    let half = 0.5 * value;
    let mut inverse = f32::from_bits(GUESS - (bits >> 1));
    inverse *= 1.5 - half * inverse * inverse;
    inverse *= 1.5 - half * inverse * inverse;
    let root = value * inverse;
    // What is wrong by 5e-6 is wrong by 1e-11 and the rounding after this: less than one and a half units in the last place.
    let near = (root + 0.5 * inverse * (value - root * root)).to_bits();
    // Is the root nearer to a neighbour? Value and root as integers, in units of the root's last place and their square. Their
    // difference is small, so the low half of each says it.
    let integer = near & FRACTION | HIDDEN;
    let shift = 150 + (bits >> 23) - 2 * (near >> 23);
    let excess = (bits << shift).wrapping_sub(integer.wrapping_mul(integer)) as i32;
    let most = integer as i32;
    f32::from_bits(near + u32::from(excess > most) - u32::from(excess <= -most))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn every_fraction_has_the_root_of_the_machine() {
        // Four times a number has twice its root, with the same fraction: these are all there are.
        for bits in 1f32.to_bits()..4f32.to_bits() {
            let value = f32::from_bits(bits);
            assert_eq!(sqrt(value).to_bits(), libm::sqrtf(value).to_bits(), "{value}");
        }
    }

    proptest! {
        #[test]
        fn any_number_has_the_root_of_the_machine(value in any::<f32>()) {
            let (ours, theirs) = (sqrt(value), libm::sqrtf(value));
            prop_assert!(ours.to_bits() == theirs.to_bits() || (ours.is_nan() && theirs.is_nan()), "{value}");
        }
    }
}
