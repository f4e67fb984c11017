//! How often something may happen that a vehicle decides: a vehicle that does it without an end is
//! not to fill queues, pages or a disk.

use stampfly_types::{Duration, Instant};

/// So many at once, and one more after each period.
#[derive(Clone, Copy, Debug)]
pub(super) struct Budget {
    period: Duration,
    /// How far ahead of time it may be.
    ahead: Duration,
    /// When everything so far is worked off.
    next: Instant,
}

impl Budget {
    pub const fn new(at_once: u64, period: Duration) -> Self {
        let ahead = Duration::from_micros(at_once * period.as_micros());
        Self { period, ahead, next: Instant::ZERO }
    }

    /// May it happen now? Then it is taken to have happened.
    pub fn takes(&mut self, now: Instant) -> bool {
        let next = self.next.max(now) + self.period;
        let may = next <= now + self.ahead;
        if may {
            self.next = next;
        }
        may
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn so_many_at_once_and_one_more_after_each_period() {
        let mut budget = Budget::new(3, Duration::from_millis(100));
        let mut taken = |at| (0..10).filter(|_| budget.takes(Instant::from_millis(at))).count();
        assert_eq!([0, 50, 100, 199, 400, 10_000].map(&mut taken), [3, 0, 1, 0, 3, 3]);
    }
}
