//! The length of a control step.
//!
//! Components are told what time it is; the ones that integrate need the span since last time. A span can be
//! wrong: zero after a repeated stamp, seconds after a stall. Integrating such a span would do more harm than a
//! slightly wrong one, so it is bounded.

use stampfly_types::{Duration, Instant};

/// Turns instants into bounded spans.
///
/// ```
/// use stampfly_control::timing::StepTimer;
/// use stampfly_types::Instant;
/// let mut timer = StepTimer::default();
/// assert_eq!(timer.step(Instant::from_micros(10_000)), 0.0025, "the first span is the nominal one");
/// assert_eq!(timer.step(Instant::from_micros(14_000)), 0.004);
/// assert_eq!(timer.step(Instant::from_micros(900_000)), 0.02, "a stall counts as 20 ms");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StepTimer {
    last: Option<Instant>,
}

impl StepTimer {
    /// The span of the first step: one period at 400 Hz.
    pub const NOMINAL: Duration = Duration::from_micros(2_500);
    /// No span is shorter.
    pub const SHORTEST: Duration = Duration::from_micros(500);
    /// No span is longer.
    pub const LONGEST: Duration = Duration::from_micros(20_000);

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
