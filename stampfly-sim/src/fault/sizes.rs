//! Plausible sizes of a fault, and the draw of a campaign.
//!
//! The *size* of a fault is the distance of its value from the value without effect. A campaign
//! draws sizes uniformly in their logarithm, so that small faults, which are hard to detect, are as
//! likely as gross ones; a uniform draw over the range would hardly ever give a small one. For
//! faults with a value only.

use crate::noise::Noise;
use core::fmt;

/// Sizes from which a campaign draws.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sizes {
    /// Definition of the size.
    pub measure: Measure,
    /// Smallest and largest size in the fault's unit, both above zero; for [`Measure::Times`] both
    /// above one.
    pub range: [f64; 2],
    /// Why this range is plausible.
    pub reason: &'static str,
}

/// Definition of a fault's size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// The value itself.
    Number,
    /// The magnitude of the value, which may have either sign.
    EitherWay,
    /// One minus the value: for a share that remains.
    BelowOne,
    /// The value or its reciprocal, whichever is above one: for a factor.
    Times,
}

impl Measure {
    /// The size of a fault with this value.
    #[must_use]
    pub fn size(self, number: f64) -> f64 {
        match self {
            Self::Number => number,
            Self::EitherWay => number.abs(),
            Self::BelowOne => 1.0 - number,
            Self::Times => number.max(1.0 / number),
        }
    }
}

impl Sizes {
    /// Draws a value whose size is uniform in its logarithm, rounded to three digits.
    ///
    /// ```
    /// use stampfly_sim::Noise;
    /// use stampfly_sim::fault::{Measure, Sizes};
    /// let sizes = Sizes { measure: Measure::EitherWay, range: [0.01, 10.0], reason: "an example" };
    /// let mut noise = Noise::new(1, 1_100);
    /// let small = (0..1_000).filter(|_| sizes.draw(&mut noise).abs() < 0.1).count();
    /// assert!((300..367).contains(&small), "a third of the decades, a third of the numbers");
    /// ```
    pub fn draw(&self, noise: &mut Noise) -> f64 {
        let [low, high] = self.range;
        // Three digits survive being written and parsed, so a campaign's fault can be repeated from
        // its text.
        let size = digits(low * libm::pow(high / low, noise.unit())).clamp(low, high);
        match self.measure {
            Measure::Number => size,
            Measure::EitherWay if noise.chance(0.5) => -size,
            Measure::EitherWay => size,
            Measure::BelowOne => digits(1.0 - size),
            Measure::Times if noise.chance(0.5) => digits(1.0 / size),
            Measure::Times => size,
        }
    }
}

/// Rounds to three significant digits.
fn digits(number: f64) -> f64 {
    format!("{number:.2e}").parse().unwrap_or(number)
}

/// The range for display.
impl fmt::Display for Sizes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [low, high] = self.range;
        match self.measure {
            Measure::Number => write!(f, "{low} to {high}"),
            Measure::EitherWay => write!(f, "\u{b1} {low} to {high}"),
            Measure::BelowOne => write!(f, "{} down to {}", digits(1.0 - low), digits(1.0 - high)),
            Measure::Times => write!(f, "{low} to {high}, or 1 by that"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRAWS: usize = 4_000;

    fn sizes(measure: Measure, range: [f64; 2]) -> Sizes {
        Sizes { measure, range, reason: "a test" }
    }

    /// Kolmogorov-Smirnov distance between the drawn sizes and a uniform distribution of the
    /// logarithm.
    fn distance(sizes: &Sizes, seed: u64) -> f64 {
        let [low, high] = sizes.range.map(libm::log);
        let mut noise = Noise::new(seed, 1);
        let size = |_| libm::log(sizes.measure.size(sizes.draw(&mut noise)));
        let mut shares: Vec<_> = (0..DRAWS).map(size).map(|size| (size - low) / (high - low)).collect();
        shares.sort_by(f64::total_cmp);
        let step = |place: usize| place as f64 / DRAWS as f64;
        let apart = |(place, share): (usize, &f64)| (share - step(place)).max(step(place + 1) - share);
        shares.iter().enumerate().map(apart).fold(0.0, f64::max)
    }

    /// Critical value of the Kolmogorov-Smirnov test at 1 %: 1.63/√n.
    #[test]
    fn sizes_are_even_in_their_logarithm() {
        let bound = 1.63 / (DRAWS as f64).sqrt();
        for (measure, range) in [
            (Measure::Number, [0.3, 30.0]),
            (Measure::EitherWay, [0.01, 10.0]),
            (Measure::BelowOne, [0.02, 0.9]),
            (Measure::Times, [1.02, 4.0]),
        ] {
            let apart = distance(&sizes(measure, range), 1);
            assert!(apart < bound, "{measure:?}: {apart} of {bound}");
        }
    }

    #[test]
    fn an_even_draw_of_the_number_would_be_noticed() {
        let [low, high] = [0.01f64, 10.0];
        let mut noise = Noise::new(1, 1);
        let small = (0..DRAWS).filter(|_| low + (high - low) * noise.unit() < 0.1).count();
        // The smallest third of the decades holds less than a hundredth of a uniform draw.
        assert!(small < DRAWS / 50, "{small}");
    }

    #[test]
    fn sizes_keep_to_their_range_and_either_sign_comes() {
        let mut noise = Noise::new(3, 1);
        for measure in [Measure::Number, Measure::EitherWay, Measure::BelowOne, Measure::Times] {
            let sizes = sizes(measure, if measure == Measure::Times { [1.1, 3.0] } else { [0.1, 1.0] });
            let numbers: Vec<_> = (0..500).map(|_| sizes.draw(&mut noise)).collect();
            // The rounded reciprocal of a size may lie slightly outside the range.
            let [low, high] = [sizes.range[0] * 0.99, sizes.range[1] * 1.01];
            let outside = numbers.iter().find(|number| !(low..=high).contains(&measure.size(**number)));
            assert_eq!(outside, None, "{measure:?}");
            let negative = numbers.iter().filter(|number| **number < 0.0).count();
            assert_eq!(measure == Measure::EitherWay, (200..300).contains(&negative), "{measure:?}: {negative}");
        }
    }
}
