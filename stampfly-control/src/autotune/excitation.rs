//! A multi-sine: eight sines at odd harmonics of one over the window, whose sum stays within a bound.
//!
//! Odd harmonics, because what a propeller's square law makes of them falls between them (R. Pintelon and J. Schoukens, *System
//! Identification: A Frequency Domain Approach*, 2nd ed., chapter 5); none next to another, so that a Hann window keeps them apart. The
//! amplitudes grow with the root of the frequency, because a vehicle answers high frequencies least. The phases were searched for a small
//! peak: with them the sum is never above twice its root mean square, where equal phases reach 3.8 times.
//!
//! Use it to excite anything for as many windows as are needed; all of them are alike. Not for one pass through a band without
//! repetition, which a chirp does in less time.

use stampfly_types::{Duration, math};

/// Number of sines.
pub const TONES: usize = 8;

/// A sine of the sum.
struct Tone {
    /// Periods in a window.
    harmonic: u16,
    /// Amplitude of its cosine and, negated, of its sine, over the bound of the sum.
    cosine: f32,
    sine: f32,
}

const fn tone(harmonic: u16, cosine: f32, sine: f32) -> Tone {
    Tone { harmonic, cosine, sine }
}

/// The amplitudes are 0.053 times the root of the harmonic.
const TABLE: [Tone; TONES] = [
    tone(5, -0.0062, -0.1175),
    tone(7, -0.1155, 0.0776),
    tone(11, 0.0512, -0.1668),
    tone(15, 0.1932, -0.0647),
    tone(21, 0.2262, -0.0834),
    tone(29, 0.2782, 0.0535),
    tone(39, 0.0124, -0.3283),
    tone(51, 0.2990, 0.2273),
];

/// The frequencies for a window of this length, rad/s, ascending: with two seconds 2.5 to 25.5 Hz.
#[must_use]
pub fn frequencies(window: Duration) -> [f32; TONES] {
    let base = math::TAU / window.seconds();
    TABLE.map(|tone| f32::from(tone.harmonic) * base)
}

/// Sine and cosine of each harmonic's angle, `into` a window.
#[inline]
pub(super) fn carriers(into: Duration, window: Duration) -> [(f32, f32); TONES] {
    TABLE.map(|tone| math::sin_cos(angle(tone.harmonic, into, window)))
}

/// The sum, `into` a window, within ±1; from the same instant's carriers.
#[inline]
pub(super) fn sum(carriers: &[(f32, f32); TONES]) -> f32 {
    let each = TABLE.iter().zip(carriers).map(|(tone, (sin, cos))| tone.cosine * cos - tone.sine * sin);
    each.sum::<f32>().clamp(-1.0, 1.0)
}

/// The angle of a harmonic, rad. Whole turns are left out as integers, so that the last window is as exact as the first.
#[inline]
pub(super) fn angle(harmonic: u16, into: Duration, window: Duration) -> f32 {
    let window = window.as_micros().max(1);
    let turned = into.as_micros().saturating_mul(u64::from(harmonic)) % window;
    math::TAU * (turned as f32 / window as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: Duration = Duration::from_secs(2);

    /// Without the clamp, which would hide a sum that is too large.
    fn at(micros: u64) -> f32 {
        let carriers = carriers(Duration::from_micros(micros), WINDOW);
        TABLE.iter().zip(&carriers).map(|(tone, (sin, cos))| tone.cosine * cos - tone.sine * sin).sum()
    }

    #[test]
    fn the_sum_stays_within_its_bound_and_is_half_of_it_on_average() {
        let values: std::vec::Vec<f32> = (0..8_000).map(|step| at(step * 250)).collect();
        let peak = values.iter().fold(0.0f32, |peak, value| peak.max(value.abs()));
        let rms = math::sqrt(values.iter().map(|value| value * value).sum::<f32>() / values.len() as f32);
        assert!(peak <= 1.0 && peak > 0.95, "{peak}");
        assert!((rms - 0.5).abs() < 0.015, "{rms}");
    }

    #[test]
    fn windows_are_alike_and_frequencies_ascend() {
        for into in [0, 2_500, 777_777, 1_999_999] {
            let (first, later) = (Duration::from_micros(into), Duration::from_micros(into + 2_000_000 * 1_000));
            assert_eq!(carriers(first, WINDOW), carriers(later, WINDOW));
        }
        let frequencies = frequencies(WINDOW);
        assert!(frequencies.is_sorted());
        assert!((frequencies[0] / math::TAU - 2.5).abs() < 1e-4 && (frequencies[7] / math::TAU - 25.5).abs() < 1e-3);
        assert!(TABLE.iter().all(|tone| tone.harmonic % 2 == 1));
        assert!(TABLE.windows(2).all(|pair| pair[1].harmonic - pair[0].harmonic >= 2));
    }
}
