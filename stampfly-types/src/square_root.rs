//! Square root by multiplications, for targets on which `libm` does not use a machine instruction.
//!
//! The result is bit-identical to `libm`'s: the root, rounded to the nearest. It takes 40
//! instructions, compared with 50 on an ARM core and 280 on an Xtensa core, where the compiler
//! makes a call of each wide product. Not for targets on which `libm` itself uses the machine's
//! instruction: x86, AArch64, WebAssembly.

/// Range of the fast path: 2⁻¹⁰⁰ to 2¹²⁶. Below it Newton's steps would meet subnormal numbers,
/// above it the square of a root would overflow.
const SMALLEST: u32 = (127 - 100) << 23;
const LARGEST: u32 = (127 + 126) << 23;

/// First guess of an inverse root, accurate to 3.5 %: it halves the number's logarithm. The
/// constant is the one of C. Lomont, "Fast Inverse Square Root", 2003, that is optimal before two
/// steps of Newton's method.
const GUESS: u32 = 0x5f37_5a86;

/// The stored bits of a number's fraction, and its implicit leading bit.
const FRACTION: u32 = (1 << 23) - 1;
const HIDDEN: u32 = 1 << 23;

/// Square root, rounded to the nearest. NaN for negative numbers.
// Forty instructions that are called from many places, some of them in fast memory.
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
    // The inverse is accurate to 5e-6 here, and this step squares that: 1e-11 plus its own
    // rounding, which is less than one and a half units in the last place.
    let near = (root + 0.5 * inverse * (value - root * root)).to_bits();
    // Checks whether a neighbour is nearer to the root. Value and squared root are integers in
    // units of the squared last place; their difference is small, so the low 32 bits of both
    // suffice.
    let integer = near & FRACTION | HIDDEN;
    let shift = 150 + (bits >> 23) - 2 * (near >> 23);
    let excess = (bits << shift).wrapping_sub(integer.wrapping_mul(integer)) as i32;
    // A neighbour is nearer when the remainder exceeds half the distance to its square:
    // (n ± ½)² ≈ n² ± n.
    let most = integer as i32;
    f32::from_bits(near + u32::from(excess > most) - u32::from(excess <= -most))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn every_fraction_has_the_root_of_the_machine() {
        // Four times a number has twice its root with the same fraction, so this range covers all
        // cases.
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
