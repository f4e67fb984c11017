//! Numbers as people like to look at them: bars, and spreads of noisy values.

use core::fmt;
use stampfly_types::{Duration, math};

/// A full bar.
const FULL: &str = "########################";

/// A value as a bar of `#`, as long as its share of the full scale.
///
/// ```
/// use examples::drivers::show::Bar;
/// assert_eq!(Bar { value: 0.5, full: 4.0 }.to_string(), "###");
/// assert_eq!(Bar { value: 9.0, full: 4.0 }.to_string().len(), 24, "never longer than that");
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Bar {
    /// What is shown; below zero shows nothing.
    pub value: f32,
    /// What fills the bar.
    pub full: f32,
}

impl fmt::Display for Bar {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // A share that is not a number gives no bar.
        let length = (self.value / self.full * FULL.len() as f32 + 0.5) as usize;
        f.pad(FULL.get(..length).unwrap_or(FULL))
    }
}

/// Mean and standard deviation of numbers that come one by one.
///
/// By Welford's method ("Note on a method for calculating corrected sums of squares and products", Technometrics 4(3),
/// 1962), which does not lose small noise on a large mean.
///
/// ```
/// use examples::drivers::show::Spread;
/// let mut spread = Spread::default();
/// [9.7, 9.9, 9.8].into_iter().for_each(|value| spread.add(value));
/// assert!((spread.mean() - 9.8).abs() < 1e-5 && (spread.deviation() - 0.1).abs() < 1e-5);
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct Spread {
    count: f32,
    mean: f32,
    squares: f32,
}

impl Spread {
    /// Takes one more.
    pub fn add(&mut self, value: f32) {
        self.count += 1.0;
        let off = value - self.mean;
        self.mean += off / self.count;
        self.squares += off * (value - self.mean);
    }

    /// The mean; zero of nothing.
    #[must_use]
    pub const fn mean(&self) -> f32 {
        self.mean
    }

    /// One standard deviation; zero of fewer than two.
    #[must_use]
    pub fn deviation(&self) -> f32 {
        if self.count < 2.0 { 0.0 } else { math::sqrt(self.squares / (self.count - 1.0)) }
    }

    /// How many it was.
    #[must_use]
    pub const fn count(&self) -> f32 {
        self.count
    }
}

/// Samples per second, when so many came after the first in this time. Zero in no time.
#[must_use]
pub fn rate(count: f32, span: Duration) -> f32 {
    if span > Duration::ZERO { count / span.seconds() } else { 0.0 }
}
