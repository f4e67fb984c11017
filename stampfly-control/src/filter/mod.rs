//! Digital filters: [`LowPass`] of first order, [`Biquad`] low-pass and notch, [`BiquadChain`] of equal stages,
//! [`DynamicNotch`] that follows a tone.
//!
//! Use a [`LowPass`] where little lag matters more than a steep edge (battery voltage, derivative terms), a
//! [`BiquadChain`] against vibration above a known frequency, a notch [`Biquad`] against one structural mode. All
//! of them are for signals sampled at a fixed rate; a rate that wanders moves the corner with it.
//!
//! A sample that is not finite is not taken: the output stays what it was, so one broken sample cannot poison the
//! state for ever.

mod biquad;
mod dynamic_notch;
mod low_pass;

pub use biquad::{Biquad, BiquadAxes, BiquadChain, BiquadCoefficients};
pub use dynamic_notch::DynamicNotch;
pub use low_pass::LowPass;

/// Why a filter could not be designed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FilterError {
    /// The corner is not between zero and half the sample rate.
    Frequency,
    /// The quality factor is not a positive number.
    Quality,
}

impl core::fmt::Display for FilterError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Frequency => "corner frequency must lie between zero and half the sample rate",
            Self::Quality => "quality factor must be positive",
        })
    }
}

impl core::error::Error for FilterError {}

/// The corner as an angle per sample, in (0, π).
fn angle_per_sample(corner: f32, sample_rate: f32) -> Result<f32, FilterError> {
    let angle = stampfly_types::math::TAU * corner / sample_rate;
    if angle > 0.0 && angle < stampfly_types::math::PI { Ok(angle) } else { Err(FilterError::Frequency) }
}
