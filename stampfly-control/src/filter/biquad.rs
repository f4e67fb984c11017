//! Second-order sections: low-pass and notch, one stage or several equal ones in series.
//!
//! Coefficients follow R. Bristow-Johnson, *Cookbook formulae for audio EQ biquad filter coefficients* (low-pass
//! and notch). The stage runs in transposed direct form II, which needs two words of state and loses the fewest
//! digits in single precision of the four classic forms.
//!
//! A low-pass of two equal stages has −6 dB at its corner and about 1.3/(π·corner) seconds of lag: at 100 Hz in a
//! 400 Hz loop that is more than a sample, so look at the phase margin before putting one into the rate loop.

use num_traits::float::FloatCore;
use stampfly_types::math;

use super::{FilterError, angle_per_sample};

/// The five numbers of a second-order section, normalised to a0 = 1.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BiquadCoefficients<T = f32> {
    /// Feed-forward: present sample, previous, the one before.
    pub b: [T; 3],
    /// Feedback: previous output, the one before.
    pub a: [T; 2],
}

impl BiquadCoefficients<f32> {
    /// Butterworth's quality factor, 1/√2: no peak in the pass band.
    pub const BUTTERWORTH: f32 = core::f32::consts::FRAC_1_SQRT_2;

    /// Low-pass with gain 1 at zero frequency and gain `quality` at the corner.
    ///
    /// # Errors
    /// When the corner is not between zero and half the sample rate, or the quality factor is not positive.
    pub fn low_pass(corner: f32, sample_rate: f32, quality: f32) -> Result<Self, FilterError> {
        let (alpha, cos, versine) = prototype(corner, sample_rate, quality)?;
        let scale = 1.0 / (1.0 + alpha);
        let b1 = versine * scale;
        Ok(Self { b: [0.5 * b1, b1, 0.5 * b1], a: [-2.0 * cos * scale, (1.0 - alpha) * scale] })
    }

    /// Notch: gain 0 at `centre`, 1 far from it; −3 dB width is centre/quality.
    ///
    /// # Errors
    /// When the centre is not between zero and half the sample rate, or the quality factor is not positive.
    pub fn notch(centre: f32, sample_rate: f32, quality: f32) -> Result<Self, FilterError> {
        let (alpha, cos, _) = prototype(centre, sample_rate, quality)?;
        let scale = 1.0 / (1.0 + alpha);
        let middle = -2.0 * cos * scale;
        Ok(Self { b: [scale, middle, scale], a: [middle, (1.0 - alpha) * scale] })
    }
}

/// α = sin ω / 2Q, cos ω and 1 − cos ω. The last as 2 sin²(ω/2), because the difference of two numbers near one
/// would lose half its digits at low corners.
fn prototype(frequency: f32, sample_rate: f32, quality: f32) -> Result<(f32, f32, f32), FilterError> {
    let angle = angle_per_sample(frequency, sample_rate)?;
    if !(quality > 0.0 && quality.is_finite()) {
        return Err(FilterError::Quality);
    }
    let (sin, cos) = math::sin_cos(angle);
    let half_sine = math::sin(0.5 * angle);
    Ok((sin / (2.0 * quality), cos, 2.0 * half_sine * half_sine))
}

/// One second-order section with its state.
///
/// ```
/// use stampfly_control::filter::{Biquad, BiquadCoefficients};
/// // A 12 Hz airframe mode, seen at 400 Hz.
/// let mut notch = Biquad::new(BiquadCoefficients::notch(12.0, 400.0, 5.0)?);
/// let last = (0..4000).map(|n| notch.step((n as f32 * 12.0 / 400.0 * core::f32::consts::TAU).sin())).last();
/// assert!(last.unwrap().abs() < 1e-3);
/// # Ok::<(), stampfly_control::filter::FilterError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Biquad<T = f32> {
    coefficients: BiquadCoefficients<T>,
    state: [T; 2],
    output: T,
}

impl<T: FloatCore> Biquad<T> {
    /// A section at rest.
    #[must_use]
    pub fn new(coefficients: BiquadCoefficients<T>) -> Self {
        Self { coefficients, state: [T::zero(); 2], output: T::zero() }
    }

    /// Takes one sample and returns the filtered value.
    #[inline]
    pub fn step(&mut self, sample: T) -> T {
        let BiquadCoefficients { b: [b0, b1, b2], a: [a1, a2] } = self.coefficients;
        let [first, second] = self.state;
        let output = b0 * sample + first;
        let state = [b1 * sample - a1 * output + second, b2 * sample - a2 * output];
        if output.is_finite() && state.iter().all(|s| s.is_finite()) {
            self.state = state;
            self.output = output;
        }
        self.output
    }

    /// Starts anew as if `value` had always been the input. A value that is not finite counts as zero.
    pub fn reset(&mut self, value: T) {
        let value = if value.is_finite() { value } else { T::zero() };
        let BiquadCoefficients { b: [b0, b1, b2], a: [a1, a2] } = self.coefficients;
        let output = value * (b0 + b1 + b2) / (T::one() + a1 + a2);
        if output.is_finite() {
            self.state = [output - b0 * value, b2 * value - a2 * output];
            self.output = output;
        }
    }

    /// Changes the design and keeps the state: for a corner that moves a little at a time.
    pub fn retune(&mut self, coefficients: BiquadCoefficients<T>) {
        self.coefficients = coefficients;
    }

    /// The present output.
    #[must_use]
    pub fn value(&self) -> T {
        self.output
    }
}

/// `N` equal sections in series; two are the usual choice against vibration.
///
/// ```
/// use stampfly_control::filter::{BiquadChain, BiquadCoefficients};
/// let design = BiquadCoefficients::low_pass(50.0, 400.0, BiquadCoefficients::BUTTERWORTH)?;
/// let mut smooth: BiquadChain<f32, 2> = BiquadChain::new(design);
/// smooth.reset(9.81);
/// assert!((smooth.step(9.81) - 9.81).abs() < 1e-4);
/// # Ok::<(), stampfly_control::filter::FilterError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(
        serialize = "[Biquad<T>; N]: serde::Serialize",
        deserialize = "[Biquad<T>; N]: serde::Deserialize<'de>"
    ))
)]
pub struct BiquadChain<T, const N: usize> {
    stages: [Biquad<T>; N],
}

impl<T: FloatCore, const N: usize> BiquadChain<T, N> {
    /// Sections at rest.
    #[must_use]
    pub fn new(coefficients: BiquadCoefficients<T>) -> Self {
        Self { stages: [Biquad::new(coefficients); N] }
    }

    /// Takes one sample and returns the filtered value.
    #[inline]
    pub fn step(&mut self, sample: T) -> T {
        self.stages.iter_mut().fold(sample, |value, stage| stage.step(value))
    }

    /// Changes the design of every section and keeps the states: for a corner that moves a little at a time.
    pub fn retune(&mut self, coefficients: BiquadCoefficients<T>) {
        self.stages.iter_mut().for_each(|stage| stage.retune(coefficients));
    }

    /// Starts anew as if `value` had always been the input.
    pub fn reset(&mut self, value: T) {
        self.stages.iter_mut().fold(value, |value, stage| {
            stage.reset(value);
            stage.value()
        });
    }
}

/// A [`BiquadChain`] for each of three axes, all of one design.
///
/// ```
/// use stampfly_control::filter::{BiquadAxes, BiquadCoefficients};
/// let design = BiquadCoefficients::low_pass(75.0, 4000.0, BiquadCoefficients::BUTTERWORTH)?;
/// let mut rate: BiquadAxes<f32, 2> = BiquadAxes::new(design);
/// rate.reset([0.1, 0.0, -0.1]);
/// assert!((rate.step([0.1, 0.0, -0.1])[2] + 0.1).abs() < 1e-6);
/// # Ok::<(), stampfly_control::filter::FilterError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(
        serialize = "[Biquad<T>; N]: serde::Serialize",
        deserialize = "[Biquad<T>; N]: serde::Deserialize<'de>"
    ))
)]
pub struct BiquadAxes<T, const N: usize> {
    axes: [BiquadChain<T, N>; 3],
}

impl<T: FloatCore, const N: usize> BiquadAxes<T, N> {
    /// Sections at rest.
    #[must_use]
    pub fn new(coefficients: BiquadCoefficients<T>) -> Self {
        Self { axes: [BiquadChain::new(coefficients); 3] }
    }

    /// Takes one sample and returns the filtered one.
    #[inline]
    pub fn step(&mut self, sample: [T; 3]) -> [T; 3] {
        let [x, y, z] = &mut self.axes;
        let [at_x, at_y, at_z] = sample;
        [x.step(at_x), y.step(at_y), z.step(at_z)]
    }

    /// Changes the design of every section and keeps the states.
    pub fn retune(&mut self, coefficients: BiquadCoefficients<T>) {
        self.axes.iter_mut().for_each(|axis| axis.retune(coefficients));
    }

    /// Starts anew as if `value` had always been the input.
    pub fn reset(&mut self, value: [T; 3]) {
        self.axes.iter_mut().zip(value).for_each(|(axis, value)| axis.reset(value));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn gain(coefficients: BiquadCoefficients, frequency: f64, sample_rate: f64) -> f64 {
        // |H(e^jω)| straight from the definition, in double precision.
        let angle = core::f64::consts::TAU * frequency / sample_rate;
        let at = |taps: &[f64]| {
            let re: f64 = taps.iter().enumerate().map(|(n, t)| t * (angle * n as f64).cos()).sum();
            let im: f64 = taps.iter().enumerate().map(|(n, t)| t * (angle * n as f64).sin()).sum();
            (re * re + im * im).sqrt()
        };
        let b: Vec<f64> = coefficients.b.iter().map(|&b| f64::from(b)).collect();
        let a: Vec<f64> = core::iter::once(1.0).chain(coefficients.a.iter().map(|&a| f64::from(a))).collect();
        at(&b) / at(&a)
    }

    #[test]
    fn the_notch_takes_its_tone_and_nothing_else() {
        let notch = BiquadCoefficients::notch(12.0, 400.0, 5.0).expect("possible");
        assert!(gain(notch, 12.0, 400.0) < 1e-3);
        assert!((gain(notch, 12.0 * 1.105, 400.0) - 0.707).abs() < 0.02, "half power one half width away");
        assert!((gain(notch, 1.0, 400.0) - 1.0).abs() < 1e-3);
        assert!((gain(notch, 100.0, 400.0) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn designs_that_cannot_be_are_refused() {
        assert_eq!(BiquadCoefficients::low_pass(200.0, 400.0, 0.7), Err(FilterError::Frequency));
        assert_eq!(BiquadCoefficients::low_pass(50.0, 400.0, 0.0), Err(FilterError::Quality));
        assert_eq!(BiquadCoefficients::notch(50.0, 400.0, f32::NAN), Err(FilterError::Quality));
    }

    proptest! {
        #[test]
        fn every_low_pass_is_stable_and_settles_on_its_input(corner in 4.0f32..190.0, level in -100f32..100.0) {
            let design = BiquadCoefficients::low_pass(corner, 400.0, BiquadCoefficients::BUTTERWORTH).expect("possible");
            // Jury's criterion for a second-order polynomial.
            prop_assert!(design.a[1].abs() < 1.0 && design.a[0].abs() < 1.0 + design.a[1]);
            let mut chain: BiquadChain<f32, 2> = BiquadChain::new(design);
            chain.reset(level);
            prop_assert!((chain.step(level) - level).abs() < 1e-2 + 1e-3 * level.abs(), "no step after a reset");
        }

        #[test]
        fn broken_samples_leave_no_trace(value in -1e3f32..1e3) {
            let mut section = Biquad::new(BiquadCoefficients::low_pass(50.0, 400.0, 0.7).expect("possible"));
            section.step(value);
            let before = section;
            section.step(f32::NAN);
            section.step(f32::INFINITY);
            prop_assert_eq!(section, before);
        }
    }
}
