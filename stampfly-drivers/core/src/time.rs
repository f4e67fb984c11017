//! A clock that can also wait.

use core::future::{Future, poll_fn};
use core::pin::pin;
use core::task::Poll;
use embedded_hal_async::delay::DelayNs;
use stampfly_types::{Duration, Instant};

/// Time stamps and delays for a driver.
///
/// Implemented by boards on a hardware timer and by the simulator on virtual time. Only drivers and
/// their tasks hold one; computing components get the time as an argument.
///
/// Each driver has a time base of its own, because the delays of many boards are not `Clone`. A
/// delay of which only one exists can be lent to one driver after the other: `&mut T` is a time
/// base, too.
///
/// Both halves have to agree: after a delay, [`now`](Self::now) has advanced. Drivers bound their
/// waits with it and return [`ChipError::ClockStopped`](crate::chip::ChipError::ClockStopped) when
/// it does not advance.
pub trait Timebase: DelayNs {
    /// Time since power-on.
    fn now(&self) -> Instant;
}

impl<T: Timebase> Timebase for &mut T {
    fn now(&self) -> Instant {
        T::now(self)
    }
}

/// Waits until `instant`; returns at once when it has passed.
pub async fn sleep_until<T: Timebase>(clock: &mut T, instant: Instant) {
    let left = instant.since(clock.now());
    if left > Duration::ZERO {
        clock.delay_us(u32::try_from(left.as_micros()).unwrap_or(u32::MAX)).await;
    }
}

/// Total of waits without any advance of the clock, after which the clock counts as stopped. A
/// clock with ticks of 10 ms does not reach it.
const STANDSTILL: Duration = Duration::from_millis(100);

/// Detects a clock that stands still although delays return. With such a clock no deadline passes,
/// and a polling loop would never end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Standstill {
    latest: Instant,
    waited: Duration,
}

impl Standstill {
    /// No wait has been observed yet.
    pub(crate) const fn new() -> Self {
        Self { latest: Instant::ZERO, waited: Duration::ZERO }
    }

    /// Records a wait of nominal length `wait` that has ended at `now`.
    pub(crate) fn note(&mut self, wait: Duration, now: Instant) {
        self.waited = if now > self.latest { Duration::ZERO } else { self.waited + wait };
        self.latest = now;
    }

    /// Whether the clock stands still. Starts over when it does.
    pub(crate) fn take(&mut self) -> bool {
        let stands = self.waited >= STANDSTILL;
        if stands {
            *self = Self::new();
        }
        stands
    }
}

/// Runs a future for at most `limit`. Drops it and returns `None` when it takes longer.
///
/// The future is polled before the timer, so a future that is ready at once starts no timer.
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
