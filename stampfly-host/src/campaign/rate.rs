//! How often something happened, and how well that is known: a share with its interval of
//! confidence.

use serde::Serialize;
use std::fmt;

/// Quantile of the standard normal distribution that leaves 2.5 % above it.
const QUANTILE: f64 = 1.959_963_984_540_054;

/// A share of flights.
///
/// ```
/// use stampfly_host::campaign::rate::Rate;
/// assert_eq!(Rate::of(0, 20).to_string(), "0.00 % (0.00 to 16.11 %)");
/// assert_eq!(Rate::of(0, 0).to_string(), "–");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rate {
    /// Flights in which it happened.
    pub count: usize,
    /// Flights in all.
    pub of: usize,
}

impl Rate {
    /// In `count` of `of`.
    #[must_use]
    pub const fn of(count: usize, of: usize) -> Self {
        Self { count, of }
    }

    /// The share; `None` of nothing.
    #[must_use]
    pub fn share(&self) -> Option<f64> {
        (self.of > 0).then(|| self.count as f64 / self.of as f64)
    }

    /// Between which shares the true one is with 95 % confidence: Wilson's score interval, which
    /// holds for rare events and for none at all (E. B. Wilson, "Probable inference, the law of
    /// succession, and statistical inference", Journal of the American Statistical Association 22,
    /// 1927). Of nothing it may be anything.
    #[must_use]
    pub fn interval(&self) -> [f64; 2] {
        let Some(share) = self.share() else { return [0.0, 1.0] };
        let (n, z2) = (self.of as f64, QUANTILE * QUANTILE);
        let middle = (share + z2 / (2.0 * n)) / (1.0 + z2 / n);
        let half = QUANTILE / (1.0 + z2 / n) * (share * (1.0 - share) / n + z2 / (4.0 * n * n)).sqrt();
        // Rounding must not put the share outside.
        [(middle - half).clamp(0.0, share), (middle + half).clamp(share, 1.0)]
    }
}

/// The share and its interval, in per cent.
impl fmt::Display for Rate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(share) = self.share() else { return f.write_str("–") };
        let [low, high] = self.interval().map(|share| 100.0 * share);
        write!(f, "{:.2} % ({low:.2} to {high:.2} %)", 100.0 * share)
    }
}

/// `count`, `of`, `rate`, `low`, `high`.
impl Serialize for Rate {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Told {
            count: usize,
            of: usize,
            rate: Option<f64>,
            low: f64,
            high: f64,
        }
        let [low, high] = self.interval();
        Told { count: self.count, of: self.of, rate: self.share(), low, high }.serialize(serializer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Table I, method 3, of R. G. Newcombe, "Two-sided confidence intervals for the single
    /// proportion: comparison of seven methods", Statistics in Medicine 17, 1998.
    #[test]
    fn intervals_are_those_of_the_textbook() {
        let near = |rate: Rate, [low, high]: [f64; 2]| {
            let found = rate.interval();
            assert!((found[0] - low).abs() < 5e-5 && (found[1] - high).abs() < 5e-5, "{rate:?}: {found:?}");
        };
        near(Rate::of(81, 263), [0.2553, 0.3662]);
        near(Rate::of(15, 148), [0.0624, 0.1605]);
        near(Rate::of(0, 20), [0.0000, 0.1611]);
        near(Rate::of(1, 29), [0.0061, 0.1718]);
    }

    #[test]
    fn an_interval_is_about_its_share_and_shrinks() {
        for of in [1usize, 3, 10, 1_000, 100_000] {
            for count in [0, 1, of / 2, of] {
                let rate = Rate::of(count, of);
                let ([low, high], share) = (rate.interval(), rate.share().expect("flights"));
                assert!((0.0..=share).contains(&low) && (share..=1.0).contains(&high), "{rate:?}");
            }
        }
        let width = |of: usize| Rate::of(of / 10, of).interval().iter().fold(0.0, |width, end| end - width);
        assert!(width(100) > 3.0 * width(1_000));
        assert_eq!(Rate::of(0, 0).interval(), [0.0, 1.0], "nothing is known");
    }
}
