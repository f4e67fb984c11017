//! A clock that can also wait.

use core::future::{Future, poll_fn};
use core::pin::pin;
use core::task::Poll;
use embedded_hal_async::delay::DelayNs;
use stampfly_types::{Duration, Instant};

/// What a driver needs to stamp its samples and to keep a chip's delays.
///
/// Implemented by boards on a hardware timer and by the simulator on virtual time. Only drivers and the tasks
/// that run them hold one; everything that computes is told the time instead.
///
/// Each driver has its own, so that delays need not be `Clone`, as those of many boards are not. One that exists but once is lent
/// to one driver after the other: `&mut T` is a time base as well.
///
/// Both halves have to agree: after a delay [`now`](Self::now) has moved on. Drivers bound their waits by it and say
/// [`ChipError::ClockStopped`](crate::chip::ChipError::ClockStopped) when it does not.
pub trait Timebase: DelayNs {
    /// Time since power-on.
    fn now(&self) -> Instant;
}

impl<T: Timebase> Timebase for &mut T {
    fn now(&self) -> Instant {
        T::now(self)
    }
}

/// Waits until an instant; returns at once when it has passed.
pub async fn sleep_until<T: Timebase>(clock: &mut T, instant: Instant) {
    let left = instant.since(clock.now());
    if left > Duration::ZERO {
        clock.delay_us(u32::try_from(left.as_micros()).unwrap_or(u32::MAX)).await;
    }
}

/// Waits that the clock took no notice of, in all, after which it counts as standing still. Clocks of 10 ms a tick are none of them.
const STANDSTILL: Duration = Duration::from_millis(100);

/// Notices a clock that stands still although delays end: a deadline would never come, and whoever polls until then would poll for ever.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Standstill {
    latest: Instant,
    waited: Duration,
}

impl Standstill {
    /// Nothing known of the clock.
    pub(crate) const fn new() -> Self {
        Self { latest: Instant::ZERO, waited: Duration::ZERO }
    }

    /// A wait is over; it was to take so long.
    pub(crate) fn note(&mut self, wait: Duration, now: Instant) {
        self.waited = if now > self.latest { Duration::ZERO } else { self.waited + wait };
        self.latest = now;
    }

    /// Does the clock stand still? Begins anew when it does.
    pub(crate) fn take(&mut self) -> bool {
        let stands = self.waited >= STANDSTILL;
        if stands {
            *self = Self::new();
        }
        stands
    }
}

/// The outcome of a future, or `None` when it takes longer than `limit`; it is dropped then.
///
/// The future is polled first, so one that never waits costs no timer.
pub(crate) async fn within<T: Timebase, F: Future>(clock: &mut T, limit: Duration, future: F) -> Option<F::Output> {
    let mut alarm = pin!(clock.delay_us(u32::try_from(limit.as_micros()).unwrap_or(u32::MAX)));
    let mut future = pin!(future);
    poll_fn(|context| {
        if let Poll::Ready(value) = future.as_mut().poll(context) {
            return Poll::Ready(Some(value));
        }
        alarm.as_mut().poll(context).map(|()| None)
    })
    .await
}
