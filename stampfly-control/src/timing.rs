//! The length of a control step.
//!
//! Components are told what time it is; the ones that integrate need the span since last time. A span can be
//! wrong: zero after a repeated stamp, seconds after a stall. Integrating such a span would do more harm than a
//! slightly wrong one, so it is bounded. Within the bounds, from 20 Hz to 10 kHz, a component adds up a second in a second.

use stampfly_types::{Duration, Instant};

/// Turns instants into bounded spans.
///
/// ```
/// use stampfly_control::timing::StepTimer;
/// use stampfly_types::Instant;
/// let mut timer = StepTimer::default();
/// assert_eq!(timer.step(Instant::from_micros(10_000)), 0.0025, "the first span is the nominal one");
/// assert_eq!(timer.step(Instant::from_micros(14_000)), 0.004);
/// assert_eq!(timer.step(Instant::from_micros(14_125)), 0.000125, "8 kHz");
/// assert_eq!(timer.step(Instant::from_micros(900_000)), 0.06, "a stall counts as 60 ms");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StepTimer {
    last: Option<Instant>,
}

impl StepTimer {
    /// The span of the first step: one period at 400 Hz.
    pub const NOMINAL: Duration = Duration::from_micros(2_500);
    /// No span is shorter: a loop at 10 kHz.
    pub const SHORTEST: Duration = Duration::from_micros(100);
    /// No span is longer: a loop at 20 Hz that is a fifth late.
    pub const LONGEST: Duration = Duration::from_micros(60_000);

    /// Seconds since the previous call, within [`Self::SHORTEST`] and [`Self::LONGEST`].
    pub fn step(&mut self, now: Instant) -> f32 {
        let span = self.last.map_or(Self::NOMINAL, |last| now.since(last));
        self.last = Some(now);
        span.clamp(Self::SHORTEST, Self::LONGEST).seconds()
    }

    /// The next span is the nominal one again.
    pub fn reset(&mut self) {
        self.last = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_is_a_second_at_any_rate() {
        for hertz in [20u64, 50, 250, 400, 1_000, 4_000, 8_000] {
            let mut timer = StepTimer::default();
            timer.step(Instant::ZERO);
            let sum: f32 = (1..=hertz).map(|n| timer.step(Instant::from_micros(n * 1_000_000 / hertz))).sum();
            assert!((sum - 1.0).abs() < 1e-3, "{sum} s at {hertz} Hz");
        }
    }

    #[test]
    fn a_repeated_stamp_and_a_stall_are_bounded() {
        let mut timer = StepTimer::default();
        timer.step(Instant::from_secs(1));
        assert_eq!(timer.step(Instant::from_secs(1)), StepTimer::SHORTEST.seconds());
        assert_eq!(timer.step(Instant::from_secs(9)), StepTimer::LONGEST.seconds());
        timer.reset();
        assert_eq!(timer.step(Instant::from_secs(9)), StepTimer::NOMINAL.seconds());
    }
}
