//! The dead man's switch: motors that nobody confirms are stopped.
//!
//! Whoever controls the motors confirms with every output; somebody else, from an interrupt on another core, looks. They
//! share four words and no lock, so neither can hold the other up, and each may stop at any instruction.
//!
//! For firmware, where control and cut-off are two contexts. In a simulation, where they are one, it has nothing to see.

use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use stampfly_types::{Duration, Instant};

/// A dead man's switch.
///
/// ```
/// use stampfly_board::tasks::DeadMan;
/// use stampfly_types::{Duration, Instant};
/// let switch = DeadMan::new(Duration::from_millis(25));
/// switch.confirm(Instant::from_millis(100), true);
/// assert!(!switch.must_cut(|| Instant::from_millis(120)));
/// assert!(switch.must_cut(|| Instant::from_millis(126)), "silent for more than 25 ms");
/// switch.confirm(Instant::from_millis(130), true);
/// assert!(switch.must_cut(|| Instant::from_millis(131)), "once cut, off until it is reset");
/// assert!(switch.reset());
/// assert!(!switch.must_cut(|| Instant::from_millis(132)));
/// ```
#[derive(Debug)]
pub struct DeadMan {
    /// How long a confirmation holds, us.
    patience: u32,
    /// The newest confirmation: the low bits of its instant in microseconds. They tell spans of up to 35 minutes; a
    /// switch nobody looked at for longer has not been watched at all.
    confirmed: AtomicU32,
    /// May the motors turn? While they may not, there is nothing to cut.
    armed: AtomicBool,
    tripped: AtomicBool,
    for_good: AtomicBool,
}

impl DeadMan {
    /// A switch that trips when motors which may turn have not been confirmed for longer than `patience`, at most half
    /// an hour.
    #[must_use]
    pub const fn new(patience: Duration) -> Self {
        Self {
            patience: patience.as_micros() as u32,
            confirmed: AtomicU32::new(0),
            armed: AtomicBool::new(false),
            tripped: AtomicBool::new(false),
            for_good: AtomicBool::new(false),
        }
    }

    /// The motors are under control; `armed` says whether they may turn.
    pub fn confirm(&self, now: Instant, armed: bool) {
        self.confirmed.store(now.as_micros() as u32, Ordering::Release);
        // After the instant: whoever sees the motors armed sees when they were.
        self.armed.store(armed, Ordering::Release);
    }

    /// May the motors turn, as far as was confirmed?
    #[must_use]
    pub fn is_armed(&self) -> bool {
        self.armed.load(Ordering::Acquire)
    }

    /// Must they be cut? To be asked at short intervals; a switch that has tripped says so every time.
    ///
    /// It reads the clock itself, last: the confirmation may come from another core at any instant, and must not seem to
    /// lie in the future.
    pub fn must_cut(&self, clock: impl FnOnce() -> Instant) -> bool {
        if self.armed.load(Ordering::Acquire) {
            let confirmed = self.confirmed.load(Ordering::Acquire);
            // Signed, should the clocks of two cores differ by a tick after all.
            let age = (clock().as_micros() as u32).wrapping_sub(confirmed).cast_signed();
            if age > self.patience.cast_signed() {
                self.tripped.store(true, Ordering::Release);
            }
        }
        self.has_tripped()
    }

    /// Has it tripped, and nobody reset it since?
    #[must_use]
    pub fn has_tripped(&self) -> bool {
        self.tripped.load(Ordering::Acquire) || self.for_good.load(Ordering::Acquire)
    }

    /// Lets the motors turn again. Returns whether they may.
    pub fn reset(&self) -> bool {
        let allowed = !self.for_good.load(Ordering::Acquire);
        if allowed {
            self.tripped.store(false, Ordering::Release);
        }
        allowed
    }

    /// Trips, and no reset helps.
    pub fn trip_for_good(&self) {
        self.for_good.store(true, Ordering::Release);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::thread;

    const PATIENCE: Duration = Duration::from_millis(25);

    #[test]
    fn motors_that_may_not_turn_are_not_cut_and_those_cut_stay_so() {
        let switch = DeadMan::new(PATIENCE);
        assert!(!switch.must_cut(|| Instant::from_secs(60)), "never armed");
        switch.confirm(Instant::from_secs(60), true);
        assert!(!switch.must_cut(|| Instant::from_secs(60) + PATIENCE));
        assert!(switch.must_cut(|| Instant::from_secs(60) + PATIENCE + Duration::from_micros(1)));
        switch.confirm(Instant::from_secs(61), false);
        assert!(switch.must_cut(|| Instant::from_secs(61)));
        assert!(switch.reset());
        assert!(!switch.must_cut(|| Instant::from_secs(70)));
        switch.trip_for_good();
        assert!(!switch.reset());
        assert!(switch.must_cut(|| Instant::from_secs(70)));
    }

    #[test]
    fn it_trips_in_time_when_the_microseconds_wrap() {
        for before in [0, 1, 24_999, 25_000] {
            let confirmed = Instant::from_micros((1 << 32) - before);
            let switch = DeadMan::new(PATIENCE);
            switch.confirm(confirmed, true);
            assert!(!switch.must_cut(|| confirmed + PATIENCE));
            assert!(switch.must_cut(|| confirmed + PATIENCE + Duration::from_micros(1)));
        }
    }

    #[test]
    fn a_confirmation_between_two_glances_is_not_from_the_future() {
        // What two cores do, tightly: one confirms all the time, the other looks all the time. The patience is long, so
        // that only a confirmation misread as an old one can trip it.
        let switch = DeadMan::new(Duration::from_secs(60));
        let start = std::time::Instant::now();
        let now = || Instant::from_micros(1 << 31) + Duration::from_micros(start.elapsed().as_micros() as u64);
        switch.confirm(now(), true);
        thread::scope(|scope| {
            scope.spawn(|| {
                while start.elapsed() < std::time::Duration::from_millis(300) {
                    switch.confirm(now(), true);
                }
            });
            while start.elapsed() < std::time::Duration::from_millis(300) {
                assert!(!switch.must_cut(now));
            }
        });
    }

    #[test]
    fn the_clock_is_read_after_the_confirmation() {
        // The confirmation comes just before the clock is read: whoever had read the clock first would call it old.
        let switch = DeadMan::new(PATIENCE);
        switch.confirm(Instant::from_secs(1), true);
        let cut = switch.must_cut(|| {
            switch.confirm(Instant::from_secs(1) + PATIENCE, true);
            Instant::from_secs(1) + PATIENCE
        });
        assert!(!cut);
        // And one that is ahead by the ticks of another core's clock is no old one either.
        switch.confirm(Instant::from_secs(2) + Duration::from_micros(3), true);
        assert!(!switch.must_cut(|| Instant::from_secs(2)));
    }
}
