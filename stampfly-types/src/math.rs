//! Transcendental functions with the same result on every target.
//!
//! The functions of two C libraries differ in the last bit: glibc and `libm` disagree on 1.3 % of
//! sines and 9.7 % of exponentials. A flight recorded on one machine would therefore not replay on
//! another. All crates of the family call these wrappers of `libm` on every target, and clippy
//! refuses the platform's functions. [`asin`], [`acos`] and [`sqrt`] clamp arguments outside their
//! domain, because a ratio rounded to 1.0000001 must not become NaN in flight.
//!
//! Cost on x86-64: 2–10 ns each. In the inner loop of a filter, update a rotation instead where
//! possible.

pub use crate::comparison::{larger, smaller};
pub use core::f32::consts::{FRAC_PI_2, PI, TAU};

/// Sine of an angle in radians.
#[must_use]
pub fn sin(angle: f32) -> f32 {
    libm::sinf(angle)
}

/// Cosine of an angle in radians.
#[must_use]
pub fn cos(angle: f32) -> f32 {
    libm::cosf(angle)
}

/// Sine and cosine of an angle in radians.
#[must_use]
pub fn sin_cos(angle: f32) -> (f32, f32) {
    libm::sincosf(angle)
}

/// Sine and cosine of an angle in radians, in double precision. For latitudes, of which an `f32` in
/// degrees resolves only about a metre.
#[must_use]
pub fn sin_cos_f64(angle: f64) -> (f64, f64) {
    libm::sincos(angle)
}

/// Tangent of an angle in radians.
#[must_use]
pub fn tan(angle: f32) -> f32 {
    libm::tanf(angle)
}

/// Arc sine; the argument is clamped to ±1.
#[must_use]
pub fn asin(ratio: f32) -> f32 {
    libm::asinf(ratio.clamp(-1.0, 1.0))
}

/// Arc cosine; the argument is clamped to ±1.
#[must_use]
pub fn acos(ratio: f32) -> f32 {
    libm::acosf(ratio.clamp(-1.0, 1.0))
}

/// Angle of the point (x, y), −π to π.
#[must_use]
pub fn atan2(y: f32, x: f32) -> f32 {
    libm::atan2f(y, x)
}

/// Square root. Negative arguments give zero.
#[inline]
#[must_use]
pub fn sqrt(value: f32) -> f32 {
    let value = if value < 0.0 { 0.0 } else { value };
    // On these targets `libm` uses the machine's instruction. The results are identical.
    if cfg!(any(target_arch = "x86", target_arch = "x86_64", target_arch = "aarch64", target_arch = "wasm32")) {
        libm::sqrtf(value)
    } else {
        crate::square_root::sqrt(value)
    }
}

/// Cube root.
#[must_use]
pub fn cbrt(value: f32) -> f32 {
    libm::cbrtf(value)
}

/// e to the power of the argument.
#[must_use]
pub fn exp(value: f32) -> f32 {
    libm::expf(value)
}

/// Natural logarithm.
#[must_use]
pub fn ln(value: f32) -> f32 {
    libm::logf(value)
}

/// `base` to the power of `exponent`.
#[must_use]
pub fn pow(base: f32, exponent: f32) -> f32 {
    libm::powf(base, exponent)
}

/// Nearest integer, halves away from zero.
#[must_use]
pub fn round(value: f32) -> f32 {
    libm::roundf(value)
}

/// Largest integer not above the argument.
#[must_use]
pub fn floor(value: f32) -> f32 {
    libm::floorf(value)
}

/// Wraps an angle into (−π, π], radians. Beyond a few thousand turns the result loses precision, as
/// the argument itself does in `f32`.
///
/// ```
/// use stampfly_types::math::{PI, wrap_angle};
/// assert!((wrap_angle(1.5 * PI) + 0.5 * PI).abs() < 1e-6);
/// ```
#[must_use]
pub fn wrap_angle(angle: f32) -> f32 {
    let turns = floor((angle + PI) / TAU);
    let wrapped = angle - turns * TAU;
    // The subtraction rounds, and the interval is open at −π.
    if wrapped <= -PI { wrapped + TAU } else { wrapped }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn arguments_outside_the_domain_are_clamped() {
        assert_eq!(acos(1.000_000_1), 0.0);
        assert_eq!(asin(-1.000_000_1), -FRAC_PI_2);
        assert_eq!(sqrt(-1e-9), 0.0);
    }

    proptest! {
        #[test]
        fn wrapped_angles_point_the_same_way(angle in -100.0f32..100.0) {
            let wrapped = wrap_angle(angle);
            prop_assert!(wrapped.abs() <= PI + 1e-5);
            prop_assert!((sin(wrapped) - sin(angle)).abs() < 1e-4);
            prop_assert!((cos(wrapped) - cos(angle)).abs() < 1e-4);
        }
    }
}
