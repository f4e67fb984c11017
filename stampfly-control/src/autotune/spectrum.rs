//! From torque and rate to points of the plant's frequency response.
//!
//! While a loop is closed, the rate's noise is in the torque as well, and the ratio of the two spectra would be an estimate of minus one
//! over the controller. Correlated with the excitation, which knows nothing of the noise, both keep what the excitation causes
//! and no more: P(jω) = S_yr / S_ur, the indirect (joint input-output) method of L. Ljung, *System Identification*, 2nd ed.,
//! chapter 13. The excitation is the same in every window, so its conjugate cancels, and what remains is the sum of the
//! rate's Fourier coefficients over the sum of the torque's: R. Pintelon and J. Schoukens, *System Identification: A Frequency Domain
//! Approach*, 2nd ed., chapter 2. How the coefficients differ from window to window says how good a point is.
//!
//! Each window is weighted with Hann's, so that gusts, which are slow and not periodic, do not leak into all frequencies.

use nalgebra::Complex;

use super::excitation::TONES;

/// One frequency of the plant's response.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PlantPoint {
    /// Angular frequency, rad/s.
    pub frequency: f32,
    /// Body rate over torque, rad/s per N·m: magnitude and phase, sampled once per control period with the torque held between.
    pub response: Complex<f32>,
    /// Standard deviation of `response` over its magnitude, from how windows differ.
    pub spread: f32,
    /// Share of the rate's power at this frequency that repeats with the excitation, 0 to 1.
    pub coherence: f32,
}

/// What one frequency has collected.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Line {
    /// Rate and torque in this window.
    y: Complex<f32>,
    u: Complex<f32>,
    /// Sums over windows.
    sum_y: Complex<f32>,
    sum_u: Complex<f32>,
    sum_yy: f32,
    sum_uu: f32,
    sum_yu: Complex<f32>,
}

/// Fourier coefficients of rate and torque at the excited frequencies, window by window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Spectrum {
    lines: [Line; TONES],
    /// Samples in this window, and in all that are closed.
    samples: u32,
    total: u32,
    windows: u16,
}

impl Spectrum {
    /// A sample; `hann` is 1 − cos of the window's own angle.
    #[inline]
    pub(super) fn add(&mut self, carriers: &[(f32, f32); TONES], hann: f32, rate: f32, torque: f32) {
        let (rate, torque) = (hann * rate, hann * torque);
        for (line, &(sin, cos)) in self.lines.iter_mut().zip(carriers) {
            line.y += Complex::new(rate * cos, -rate * sin);
            line.u += Complex::new(torque * cos, -torque * sin);
        }
        self.samples = self.samples.saturating_add(1);
    }

    /// The window is complete.
    pub(super) fn close(&mut self) {
        let scale = 1.0 / self.samples.max(1) as f32;
        for line in &mut self.lines {
            let (y, u) = (line.y * scale, line.u * scale);
            line.sum_y += y;
            line.sum_u += u;
            line.sum_yy += y.norm_sqr();
            line.sum_uu += u.norm_sqr();
            line.sum_yu += y * u.conj();
            (line.y, line.u) = (Complex::default(), Complex::default());
        }
        self.total = self.total.saturating_add(self.samples);
        self.samples = 0;
        self.windows = self.windows.saturating_add(1);
    }

    /// Windows that are complete.
    pub(super) fn windows(&self) -> u16 {
        self.windows
    }

    /// Samples in this window so far.
    pub(super) fn samples(&self) -> u32 {
        self.samples
    }

    /// Samples of complete windows.
    pub(super) fn total(&self) -> u32 {
        self.total
    }

    /// The points, from two windows on. What was not excited is no number, with a spread that is none either.
    pub(super) fn points(&self, frequencies: &[f32; TONES]) -> [PlantPoint; TONES] {
        core::array::from_fn(|index| match (self.lines.get(index), frequencies.get(index)) {
            (Some(line), Some(frequency)) => line.point(*frequency, f32::from(self.windows)),
            _ => PlantPoint { frequency: f32::NAN, response: Complex::default(), spread: f32::NAN, coherence: 0.0 },
        })
    }
}

impl Line {
    fn point(&self, frequency: f32, windows: f32) -> PlantPoint {
        let response = self.sum_y / self.sum_u;
        // What is left of each window's rate once its torque is accounted for: Σ |Y − P·U|².
        let explained = 2.0 * (response.conj() * self.sum_yu).re - response.norm_sqr() * self.sum_uu;
        // Rounding must not make a perfect point better than perfect.
        let left = (self.sum_yy - explained).max(0.0);
        let of_mean = left * windows / (windows - 1.0);
        PlantPoint {
            frequency,
            response,
            spread: stampfly_types::math::sqrt(of_mean / self.sum_y.norm_sqr()),
            coherence: self.sum_y.norm_sqr() / (windows * self.sum_yy),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::excitation::{carriers, frequencies, sum};
    use super::*;
    use stampfly_types::{Duration, math};

    const WINDOW: Duration = Duration::from_secs(2);

    /// Eight windows of a torque and of an integrator of gain 3 that is a sample late, with this much noise on the rate.
    fn points(noise: f32) -> [PlantPoint; TONES] {
        let mut spectrum = Spectrum::default();
        let (mut rate, mut random) = (0.0f32, 1u32);
        for step in 0..6_400u64 {
            let carriers = carriers(Duration::from_micros(step * 2_500), WINDOW);
            let (_, cos) = math::sin_cos(math::TAU * ((step % 800) as f32 / 800.0));
            let torque = sum(&carriers);
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let white = ((random >> 8) as f32 / (1 << 23) as f32 - 1.0) * 1.732;
            spectrum.add(&carriers, 1.0 - cos, rate + noise * white, torque);
            rate += 3.0 * torque * 0.0025;
            if step % 800 == 799 {
                spectrum.close();
            }
        }
        assert_eq!((spectrum.windows(), spectrum.total(), spectrum.samples()), (8, 6_400, 0));
        spectrum.points(&frequencies(WINDOW))
    }

    /// Relative error against the integrator: its sample is held, so it acts half a period late.
    fn error(point: &PlantPoint) -> f32 {
        let half = 0.5 * 0.0025 * point.frequency;
        let (sin, cos) = math::sin_cos(half);
        let truth = Complex::new(cos, -sin) * Complex::new(0.0, -3.0 * 0.0025 * 0.5 / sin);
        math::sqrt((point.response / truth - 1.0).norm_sqr())
    }

    #[test]
    fn an_integrator_is_found_exactly() {
        for point in points(0.0) {
            assert!(error(&point) < 2e-3 && point.spread < 2e-3 && point.coherence > 0.999, "{point:?}");
        }
    }

    #[test]
    fn noise_is_told_as_spread() {
        let (mut errors, mut told) = (0.0, 0.0);
        for point in points(0.05) {
            assert!(point.spread > 0.005 && error(&point) < 4.0 * point.spread, "{point:?} off by {}", error(&point));
            errors += error(&point) * error(&point);
            told += point.spread * point.spread;
        }
        assert!((0.25..4.0).contains(&(errors / told)), "{errors} where {told} was told");
    }

    #[test]
    fn what_was_not_excited_is_no_number() {
        let mut spectrum = Spectrum::default();
        spectrum.close();
        spectrum.close();
        assert!(spectrum.points(&frequencies(WINDOW)).iter().all(|point| point.spread.is_nan()));
    }
}
