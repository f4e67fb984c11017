//! The angular rates of the last moments, to ask for their mean over a stretch of time that has passed.
//!
//! A flow sensor reports what it saw a picture or two ago. The rotation to take out of that is the rotation of then: a
//! hand that swings by ±5 rad/s twice a second changes the rate by 1 rad/s within those twenty milliseconds.

use stampfly_types::{Micros, Vec3};

/// Samples kept: 40 ms at 400 Hz.
const DEPTH: usize = 16;

/// A rate, and the stretch of time it stands for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Entry {
    end: Micros,
    length: f32,
    rate: Vec3,
}

/// The last sixteen rates. See the [module](self) documentation.
///
/// ```
/// use stampfly_eskf::filter::RateHistory;
/// use stampfly_types::{Micros, Vec3};
/// let mut history = RateHistory::default();
/// history.add(Micros(10_000), 0.01, Vec3::x());
/// history.add(Micros(20_000), 0.01, Vec3::zeros());
/// assert_eq!(history.mean(Micros(15_000), 0.01), Some(0.5 * Vec3::x()));
/// assert_eq!(history.mean(Micros(40_000), 0.01), None);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RateHistory {
    entries: [Entry; DEPTH],
    next: usize,
}

impl RateHistory {
    /// Remembers a rate that held for `length` seconds until `end`.
    pub fn add(&mut self, end: Micros, length: f32, rate: Vec3) {
        if let Some(entry) = self.entries.get_mut(self.next) {
            *entry = Entry { end, length, rate };
        }
        self.next = (self.next + 1) % DEPTH;
    }

    /// Mean over the `length` seconds until `end`, as far as they are remembered. `None` when no part of them is.
    #[must_use]
    pub fn mean(&self, end: Micros, length: f32) -> Option<Vec3> {
        let (mut sum, mut time) = (Vec3::zeros(), 0.0f32);
        for entry in &self.entries {
            // Both ends in seconds before `end`, negative when after it.
            let newer = end.since(entry.end).seconds() - entry.end.since(end).seconds();
            let older = (newer + entry.length).min(length);
            let overlap = older - newer.max(0.0);
            if overlap > 0.0 {
                sum += entry.rate * overlap;
                time += overlap;
            }
        }
        (time > 1e-5).then(|| sum / time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// A rate that grows evenly has the mean that it has in the middle of the stretch.
        #[test]
        fn an_even_change_is_averaged_exactly(end in 20_000u64..38_000, length in 0.004f32..0.012) {
            let mut history = RateHistory::default();
            for step in 1..=40u64 {
                // The mean over a step is the value in its middle.
                history.add(Micros(step * 2_500), 0.0025, Vec3::x() * (step as f32 - 0.5) * 0.0025);
            }
            // Steps 25 to 40 are remembered: 60 to 100 ms.
            let end = Micros(end + 62_000);
            let expected = end.seconds() - 0.5 * length;
            let mean = history.mean(end, length).expect("remembered").x;
            // Inside a step the rate is taken as constant.
            prop_assert!((mean - expected).abs() < 0.0013, "{mean}, not {expected}");
        }
    }

    #[test]
    fn what_was_never_seen_is_not_made_up() {
        let history = RateHistory::default();
        assert_eq!(history.mean(Micros(5_000), 0.01), None);
    }
}
