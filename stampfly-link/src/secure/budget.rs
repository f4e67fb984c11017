//! How many bad frames are worked on: a flood must not take the processor.
//!
//! What a check of the tag costs is known, so that many in a tick are known, too. Only frames that are refused after their
//! tag was looked at are counted; those that the cheap checks refuse cost next to nothing, and authentic ones come from the
//! station alone. The last places of a tick are for frames that say they are a kill.

use stampfly_types::{Duration, Instant};

/// The period that frames are counted in: a step of the flight loop.
const TICK: Duration = Duration::from_micros(2_500);
/// Bad frames of a tick that are worked on.
const ALL: u8 = 8;
/// Those of them that only frames of the kind kill may take.
const FOR_KILLS: u8 = 2;

/// Counts bad frames, at most eight in a tick of 2.5 ms.
///
/// ```
/// use stampfly_link::secure::Budget;
/// use stampfly_types::Instant;
/// let (mut budget, now) = (Budget::new(), Instant::ZERO);
/// (0..6).for_each(|_| budget.charge(now));
/// assert!(!budget.admits(now, false) && budget.admits(now, true));
/// assert!(budget.admits(Instant::from_micros(2_500), false), "the next tick");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Budget {
    tick: u64,
    bad: u8,
}

impl Budget {
    /// Nothing has been worked on.
    #[must_use]
    pub const fn new() -> Self {
        Self { tick: 0, bad: 0 }
    }

    /// May a frame be worked on now? `urgent`: it says it is a kill.
    pub fn admits(&mut self, now: Instant, urgent: bool) -> bool {
        let tick = now.as_micros() / TICK.as_micros();
        if tick != self.tick {
            (self.tick, self.bad) = (tick, 0);
        }
        self.bad < if urgent { ALL } else { ALL - FOR_KILLS }
    }

    /// A frame was worked on, and was bad.
    pub fn charge(&mut self, now: Instant) {
        let _ = self.admits(now, true);
        self.bad = self.bad.saturating_add(1);
    }
}
