//! Virtual clock and its sleep future.
//!
//! A sleeping future stores its deadline in a cell of the clock when it is polled, and the executor
//! reads this cell after the poll. No allocation, timer list or waker is involved, so a thousand
//! wakes per simulated second cost next to nothing.

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
    /// Earliest deadline requested since the executor last read it.
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

    /// Advances the clock. An earlier instant has no effect.
    ///
    /// [`Tasks`](super::Tasks) calls this; call it directly only without an executor.
    pub fn advance_to(&self, instant: Instant) {
        self.0.now.set(self.now().max(instant));
    }

    /// Waits until the clock shows at least `deadline`.
    pub fn sleep_until(&self, deadline: Instant) -> Sleep {
        Sleep { clock: self.clone(), deadline }
    }

    /// Takes the earliest deadline requested since the last call.
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
    /// Waits at least this long, rounded up to whole microseconds, the resolution of the clock.
    async fn delay_ns(&mut self, ns: u32) {
        self.sleep_until(self.now() + Duration::from_micros(u64::from(ns).div_ceil(1_000))).await;
    }
}

impl embedded_hal::delay::DelayNs for Clock {
    /// Advances the clock immediately. Other tasks on the same clock run late, as with any blocking
    /// driver.
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
