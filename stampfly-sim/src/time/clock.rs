//! The virtual clock and its only way of waiting.
//!
//! A sleeping future leaves its deadline in a cell of the clock when it is polled; the executor reads that cell
//! after the poll. Nothing is allocated, no list of timers is kept and no waker is called to sleep, which is
//! what makes a thousand wakes per simulated second cost next to nothing.

use core::cell::Cell;
use core::future::Future;
use core::pin::Pin;
use core::task::{Context, Poll};
use embedded_hal_async::delay::DelayNs;
use stampfly_drivers::Timebase;
use stampfly_types::{Duration, Instant};
use std::rc::Rc;

#[derive(Debug)]
struct State {
    now: Cell<Instant>,
    /// Earliest deadline asked for since the executor last looked.
    wanted: Cell<Option<Instant>>,
}

/// A clock on virtual time. Clones show the same time.
///
/// ```
/// use stampfly_sim::time::{Clock, block_on};
/// use stampfly_types::Instant;
///
/// let clock = Clock::new(Instant::from_secs(3600));
/// block_on(&clock, clock.sleep_until(Instant::from_secs(7200)));
/// assert_eq!(clock.now(), Instant::from_secs(7200));
/// ```
#[derive(Clone, Debug)]
pub struct Clock(Rc<State>);

impl Clock {
    /// A clock that shows `start`.
    #[must_use]
    pub fn new(start: Instant) -> Self {
        Self(Rc::new(State { now: Cell::new(start), wanted: Cell::new(None) }))
    }

    /// The present instant.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.0.now.get()
    }

    /// Moves the clock on. It never goes back: an earlier instant changes nothing.
    ///
    /// [`Tasks`](super::Tasks) calls this; call it yourself only where no executor runs.
    pub fn advance_to(&self, instant: Instant) {
        self.0.now.set(self.now().max(instant));
    }

    /// Waits until the clock shows at least `deadline`.
    pub fn sleep_until(&self, deadline: Instant) -> Sleep {
        Sleep { clock: self.clone(), deadline }
    }

    /// The earliest deadline asked for since the last call.
    pub(super) fn take_wanted(&self) -> Option<Instant> {
        self.0.wanted.take()
    }
}

impl Timebase for Clock {
    fn now(&self) -> Instant {
        Clock::now(self)
    }
}

impl DelayNs for Clock {
    /// Waits at least this long; the clock counts microseconds, so a fraction of one is a whole one.
    async fn delay_ns(&mut self, ns: u32) {
        self.sleep_until(self.now() + Duration::from_micros(u64::from(ns).div_ceil(1_000))).await;
    }
}

impl embedded_hal::delay::DelayNs for Clock {
    /// Moves the clock on at once. Where other tasks share the clock they run late, as beside any blocking driver.
    fn delay_ns(&mut self, ns: u32) {
        self.advance_to(self.now() + Duration::from_micros(u64::from(ns).div_ceil(1_000)));
    }
}

/// The future of [`Clock::sleep_until`].
#[derive(Debug)]
#[must_use = "a future does nothing until it is awaited"]
pub struct Sleep {
    clock: Clock,
    deadline: Instant,
}

impl Future for Sleep {
    type Output = ();

    fn poll(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<()> {
        if self.clock.now() >= self.deadline {
            return Poll::Ready(());
        }
        let wanted = &self.clock.0.wanted;
        wanted.set(Some(wanted.get().map_or(self.deadline, |other| other.min(self.deadline))));
        Poll::Pending
    }
}
