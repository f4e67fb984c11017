//! A watchdog for motors: armed motors that are not confirmed in time are cut off.
//!
//! The task that drives the motors [feeds](Watchdog::feed) it with every output; an interrupt, on another core if there
//! is one, asks whether it has [expired](Watchdog::expired) and then cuts the motors. Both sides share a few atomic words
//! and no lock: neither can hold up the other, and each may stop at any instruction.
//!
//! For firmware, where driving and cutting off are two contexts. Not for a simulation, where they are one and stop
//! together, and no replacement for a hardware watchdog, which resets the chip when both contexts hang.

use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use stampfly_types::{Duration, Instant};

/// Cuts off motors that are armed and not fed.
///
/// ```
/// use stampfly_flight::Watchdog;
/// use stampfly_types::{Duration, Instant};
/// static WATCHDOG: Watchdog = Watchdog::new(Duration::from_millis(25));
/// WATCHDOG.feed(Instant::from_millis(100), true);
/// assert!(!WATCHDOG.expired(|| Instant::from_millis(120)));
/// assert!(WATCHDOG.expired(|| Instant::from_millis(126)), "not fed for more than 25 ms");
/// WATCHDOG.feed(Instant::from_millis(130), true);
/// assert!(WATCHDOG.expired(|| Instant::from_millis(131)), "stays expired until it is reset");
/// assert!(WATCHDOG.reset());
/// assert!(!WATCHDOG.expired(|| Instant::from_millis(132)));
/// ```
#[derive(Debug)]
pub struct Watchdog {
    /// Microseconds, positive as an `i32`.
    timeout: u32,
    /// The instant of the last feed: its low 32 bits in microseconds, because targets without 64-bit atomics share it.
    /// They tell ages of up to 35 minutes, and [`expired`](Self::expired) is asked far more often than that.
    fed: AtomicU32,
    /// Disarmed motors stand still: there is nothing to cut off.
    armed: AtomicBool,
    expired: AtomicBool,
    locked: AtomicBool,
}

impl Watchdog {
    /// A watchdog that expires when armed motors are not fed for longer than `timeout`, which is capped at 35 minutes.
    #[must_use]
    pub const fn new(timeout: Duration) -> Self {
        let micros = timeout.as_micros();
        let longest = i32::MAX as u32;
        Self {
            timeout: if micros > longest as u64 { longest } else { micros as u32 },
            fed: AtomicU32::new(0),
            armed: AtomicBool::new(false),
            expired: AtomicBool::new(false),
            locked: AtomicBool::new(false),
        }
    }

    /// Confirms that the motors are under control at `now`; `armed` says whether they may turn.
    pub fn feed(&self, now: Instant, armed: bool) {
        self.fed.store(now.as_micros() as u32, Ordering::Release);
        // After the instant, so that a context that sees the motors armed also sees since when.
        self.armed.store(armed, Ordering::Release);
    }

    /// May the motors turn, according to the last feed?
    #[must_use]
    pub fn is_armed(&self) -> bool {
        self.armed.load(Ordering::Acquire)
    }

    /// Must the motors be cut off? Ask at intervals well below the timeout. Once expired, it stays so until
    /// [`reset`](Self::reset).
    ///
    /// It reads the clock itself, after the last feed: a feed from another core in between would seem to lie in the future.
    pub fn expired(&self, clock: impl FnOnce() -> Instant) -> bool {
        if self.is_armed() {
            let fed = self.fed.load(Ordering::Acquire);
            // Signed, because the clocks of two cores may differ by a tick.
            let age = (clock().as_micros() as u32).wrapping_sub(fed).cast_signed();
            if age > self.timeout.cast_signed() {
                self.expired.store(true, Ordering::Release);
            }
        }
        self.has_expired()
    }

    /// Has it expired since the last reset, as far as was asked?
    #[must_use]
    pub fn has_expired(&self) -> bool {
        self.expired.load(Ordering::Acquire) || self.locked.load(Ordering::Acquire)
    }

    /// Lets the motors turn again. Returns `false` after [`lock_out`](Self::lock_out), which it cannot undo.
    pub fn reset(&self) -> bool {
        let allowed = !self.locked.load(Ordering::Acquire);
        if allowed {
            self.expired.store(false, Ordering::Release);
        }
        allowed
    }

    /// Expires until the next power-on. For a panic handler and a failed self test.
    pub fn lock_out(&self) {
        self.locked.store(true, Ordering::Release);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::thread;

    const TIMEOUT: Duration = Duration::from_millis(25);
    const TICK: Duration = Duration::from_micros(1);

    #[test]
    fn it_expires_only_while_armed_and_until_it_is_reset() {
        let watchdog = Watchdog::new(TIMEOUT);
        let fed = Instant::from_secs(60);
        assert!(!watchdog.expired(|| fed), "never armed");
        watchdog.feed(fed, true);
        assert!(!watchdog.expired(|| fed + TIMEOUT));
        assert!(watchdog.expired(|| fed + TIMEOUT + TICK));
        watchdog.feed(fed + TIMEOUT, false);
        assert!(watchdog.expired(|| fed + TIMEOUT), "expired is expired");
        assert!(watchdog.reset());
        assert!(!watchdog.expired(|| fed + TIMEOUT * 100), "disarmed");
        watchdog.lock_out();
        assert!(!watchdog.reset());
        assert!(watchdog.expired(|| fed + TIMEOUT * 100));
    }

    #[test]
    fn it_expires_in_time_when_the_microseconds_wrap() {
        for before in [0, 1, 24_999, 25_000] {
            let fed = Instant::from_micros((1 << 32) - before);
            let watchdog = Watchdog::new(TIMEOUT);
            watchdog.feed(fed, true);
            assert!(!watchdog.expired(|| fed + TIMEOUT));
            assert!(watchdog.expired(|| fed + TIMEOUT + TICK));
        }
        let slow = Watchdog::new(Duration::MAX);
        slow.feed(Instant::ZERO, true);
        assert!(!slow.expired(|| Instant::from_secs(35 * 60)));
    }

    #[test]
    fn two_cores_do_not_mistake_a_feed_for_an_old_one() {
        // One core feeds all the time, the other asks all the time. The timeout is long, so that only a misread feed can
        // expire it. The clock starts where its low half changes sign.
        let watchdog = Watchdog::new(Duration::from_secs(60));
        let start = std::time::Instant::now();
        let now = || Instant::from_micros((1 << 31) + start.elapsed().as_micros() as u64);
        watchdog.feed(now(), true);
        let span = std::time::Duration::from_millis(200);
        thread::scope(|scope| {
            scope.spawn(|| {
                while start.elapsed() < span {
                    watchdog.feed(now(), true);
                }
            });
            while start.elapsed() < span {
                assert!(!watchdog.expired(now));
            }
        });
    }

    #[test]
    fn the_clock_is_read_after_the_feed() {
        let watchdog = Watchdog::new(TIMEOUT);
        let fed = Instant::from_secs(1);
        watchdog.feed(fed, true);
        let expired = watchdog.expired(|| {
            watchdog.feed(fed + TIMEOUT, true);
            fed + TIMEOUT
        });
        assert!(!expired);
        // A feed that is ahead by the ticks of another core's clock is not old either.
        watchdog.feed(Instant::from_secs(2) + TICK * 3, true);
        assert!(!watchdog.expired(|| Instant::from_secs(2)));
    }
}
