//! A notch that follows the strongest tone in a band: propeller vibration moves with the throttle.
//!
//! A bank of leaky resonators looks at the band, each a discrete Fourier transform with an exponential window:
//! S ← λ·e^(jω)·S + x (Jacobsen and Lyons, "The Sliding DFT", IEEE Signal Processing Magazine 20(2), 2003, with the
//! leak instead of the delay line). The strongest one, interpolated between its neighbours, is where the notch goes. A
//! band without a tone leaves the signal as it is: the notch is faded in and out, not switched.
//!
//! Costs four multiplications a resonator and sample, and a retuning of the notch every eighth sample. Use a fixed
//! [`Biquad`] where the frequency is known, and a low-pass where everything above a corner is unwanted. Not for tones
//! that change by more than the band within a tenth of a second, and not for several equally strong ones: it follows
//! one. It must lie well above what the controller needs, as every notch turns the phase below it.

use super::{Biquad, BiquadCoefficients, FilterError, LowPass, angle_per_sample};
use stampfly_types::math;

/// Samples between two looks at the spectrum.
const LOOK: u8 = 8;
/// A tone must have this many times the mean power of the band's resonators to be one: a tone between two of sixteen has
/// five times, the strongest of sixteen in noise seldom more than four.
const PROMINENCE: f32 = 4.5;
/// Time constants of the frequency and of the fading, in looks.
const FOLLOW: f32 = 0.25;
const FADE: f32 = 0.1;

/// One line of the spectrum.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Resonator {
    /// λ·e^(jω).
    turn: [f32; 2],
    state: [f32; 2],
}

impl Resonator {
    #[inline]
    fn step(&mut self, sample: f32) {
        let ([cos, sin], [re, im]) = (self.turn, self.state);
        self.state = [cos * re - sin * im + sample, sin * re + cos * im];
    }

    fn power(&self) -> f32 {
        let [re, im] = self.state;
        re * re + im * im
    }
}

/// A notch that follows the strongest tone of a band, seen by `BINS` resonators, and seldom there in noise alone.
///
/// For vibration that moves with the throttle. It costs four multiplications a resonator and sample; a fixed
/// [`Biquad`] is cheaper where the frequency is known.
///
/// ```
/// use stampfly_control::filter::DynamicNotch;
/// // 60 to 180 Hz at 400 Hz, seen 8 Hz apart.
/// let mut notch = DynamicNotch::<16>::new([60.0, 180.0], 400.0, 3.0)?;
/// let tone = |n: u32| (n as f32 * 117.0 / 400.0 * core::f32::consts::TAU).sin();
/// let late = (0..1200).map(|n| notch.step(tone(n))).skip(800).fold(0.0f32, |most, y| most.max(y.abs()));
/// assert!(late < 0.1, "{late}");
/// assert!((notch.frequency().unwrap() - 117.0).abs() < 2.0);
/// # Ok::<(), stampfly_control::filter::FilterError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(
        serialize = "[Resonator; BINS]: serde::Serialize",
        deserialize = "[Resonator; BINS]: serde::Deserialize<'de>"
    ))
)]
pub struct DynamicNotch<const BINS: usize> {
    resonators: [Resonator; BINS],
    lowest: f32,
    spacing: f32,
    sample_rate: f32,
    quality: f32,
    count: u8,
    frequency: LowPass<f32>,
    /// How much of the notch is in the output, 0 to 1.
    share: f32,
    notch: Biquad<f32>,
}

impl<const BINS: usize> DynamicNotch<BINS> {
    /// A notch for tones within `band`, Hz; −3 dB width is centre/`quality`.
    ///
    /// # Errors
    /// When the band is not between zero and half the sample rate, not in ascending order or seen by fewer than three
    /// resonators, or the quality factor is not positive.
    pub fn new(band: [f32; 2], sample_rate: f32, quality: f32) -> Result<Self, FilterError> {
        let [lowest, highest] = band;
        let spacing = (highest - lowest) / (BINS as f32 - 1.0);
        if BINS < 3 || spacing.is_nan() || spacing <= 0.0 {
            return Err(FilterError::Frequency);
        }
        // The window's half width is the spacing: neighbours overlap, so that a tone between two shows in both.
        let leak = math::exp(-angle_per_sample(spacing, sample_rate)? * 0.5);
        let mut resonators = [Resonator::default(); BINS];
        for (n, resonator) in resonators.iter_mut().enumerate() {
            let (sin, cos) = math::sin_cos(angle_per_sample(lowest + n as f32 * spacing, sample_rate)?);
            resonator.turn = [leak * cos, leak * sin];
        }
        let middle = 0.5 * (lowest + highest);
        let mut frequency = LowPass::with_alpha(FOLLOW);
        frequency.reset(middle);
        let notch = Biquad::new(BiquadCoefficients::notch(middle, sample_rate, quality)?);
        Ok(Self { resonators, lowest, spacing, sample_rate, quality, count: 0, frequency, share: 0.0, notch })
    }

    /// Takes one sample and returns the filtered value. A sample that is not finite changes nothing and gives the last
    /// value of the notch.
    #[inline]
    pub fn step(&mut self, sample: f32) -> f32 {
        if !sample.is_finite() {
            return self.notch.value();
        }
        for resonator in &mut self.resonators {
            resonator.step(sample);
        }
        self.count = self.count.saturating_add(1);
        if self.count >= LOOK {
            self.count = 0;
            self.look();
        }
        sample + self.share * (self.notch.step(sample) - sample)
    }

    /// Where the tone is, Hz; `None` while there is none.
    #[must_use]
    pub fn frequency(&self) -> Option<f32> {
        (self.share > 0.5).then(|| self.frequency.value())
    }

    fn look(&mut self) {
        let tone = self.tone();
        self.share += FADE * (if tone.is_some() { 1.0 } else { 0.0 } - self.share);
        let Some(tone) = tone else { return };
        // Far from where it was while nothing was followed: go there at once.
        if self.share < 2.0 * FADE {
            self.frequency.reset(tone);
        }
        let frequency = self.frequency.step(tone);
        if let Ok(coefficients) = BiquadCoefficients::notch(frequency, self.sample_rate, self.quality) {
            self.notch.retune(coefficients);
        }
    }

    /// The frequency of the strongest tone, if there is one.
    fn tone(&self) -> Option<f32> {
        let (mut strongest, mut most, mut sum) = (0, 0.0, 0.0);
        for (n, resonator) in self.resonators.iter().enumerate() {
            let power = resonator.power();
            sum += power;
            if power > most {
                (strongest, most) = (n, power);
            }
        }
        if most * (BINS as f32) < PROMINENCE * sum || most <= 0.0 {
            return None;
        }
        // A leaky resonator's power falls as 1/(width² + distance²), so the inverses lie on a parabola. At an edge the
        // tone may lie outside the band.
        let inverse = |n: Option<usize>| {
            let power = n.and_then(|n| self.resonators.get(n)).map(Resonator::power);
            power.filter(|power| *power > 0.0).map(|power| most / power)
        };
        let (left, right) = (inverse(strongest.checked_sub(1))?, inverse(strongest.checked_add(1))?);
        let bend = left - 2.0 + right;
        let offset = if bend > 0.0 { (0.5 * (left - right) / bend).clamp(-0.5, 0.5) } else { 0.0 };
        Some(self.lowest + (strongest as f32 + offset) * self.spacing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    const RATE: f32 = 400.0;

    fn ours() -> DynamicNotch<16> {
        DynamicNotch::new([60.0, 180.0], RATE, 3.0).unwrap()
    }

    fn rms(values: &[f32]) -> f32 {
        math::sqrt(values.iter().map(|v| v * v).sum::<f32>() / values.len() as f32)
    }

    #[test]
    fn follows_a_throttle_from_idle_to_full() {
        let (mut notch, mut phase, mut worst) = (ours(), 0.0f32, 0.0f32);
        let mut last = Vec::new();
        for n in 0..2400 {
            // 75 to 165 Hz within five seconds, then steady.
            let frequency = 75.0 + 90.0 * (n as f32 / 2000.0).min(1.0);
            phase = math::wrap_angle(phase + frequency / RATE * math::TAU);
            last.push(notch.step(math::sin(phase)));
            if n > 200 {
                worst = worst.max((notch.frequency().expect("a tone") - frequency).abs());
            }
        }
        assert!(worst < 5.0, "{worst} Hz behind");
        assert!(rms(&last[400..2000]) < 0.25 * 0.707, "moving: {}", rms(&last[400..2000]));
        assert!(rms(&last[2200..]) < 0.05, "steady: {}", rms(&last[2200..]));
    }

    proptest! {
        #[test]
        fn what_the_controller_needs_passes(tone in 80f32..160.0, slow in 1f32..15.0) {
            let mut notch = ours();
            let wave = |frequency: f32, n: i32| math::sin(math::wrap_angle((n as f32 * frequency / RATE).fract() * math::TAU));
            let out: Vec<f32> = (0..1600).map(|n| notch.step(wave(tone, n) + wave(slow, n))).collect();
            let left: Vec<f32> = (800..1600).map(|n| out[n as usize]).collect();
            // The slow wave is there, the tone is not.
            prop_assert!((rms(&left) / 0.707 - 1.0).abs() < 0.15, "{}", rms(&left));
        }

        #[test]
        fn in_noise_the_notch_is_seldom_there(seed in any::<u64>()) {
            let (mut notch, mut bits, mut touched) = (ours(), seed | 1, 0.0f32);
            for _ in 0..4000 {
                bits ^= bits << 13;
                bits ^= bits >> 7;
                bits ^= bits << 17;
                let noise = (bits >> 40) as f32 / 8_388_608.0 - 1.0;
                touched += notch.share / 4000.0;
                let out = notch.step(noise);
                prop_assert!(out.is_finite());
            }
            prop_assert!(touched < 0.3, "{touched}");
        }

        #[test]
        fn no_input_breaks_it(samples in prop::collection::vec(any::<f32>(), 0..300)) {
            let mut notch = ours();
            for sample in samples {
                notch.step(if sample.abs() < 1e12 { sample } else { f32::NAN });
                prop_assert!(notch.step(0.0).is_finite());
            }
        }
    }

    #[test]
    fn a_band_that_is_none_is_refused() {
        assert_eq!(DynamicNotch::<16>::new([180.0, 60.0], RATE, 3.0), Err(FilterError::Frequency));
        assert_eq!(DynamicNotch::<16>::new([60.0, 210.0], RATE, 3.0), Err(FilterError::Frequency));
        assert_eq!(DynamicNotch::<2>::new([60.0, 180.0], RATE, 3.0), Err(FilterError::Frequency));
        assert_eq!(DynamicNotch::<16>::new([60.0, 180.0], RATE, 0.0), Err(FilterError::Quality));
        assert_eq!(DynamicNotch::<16>::new([f32::NAN, 180.0], RATE, 1.0), Err(FilterError::Frequency));
    }
}
