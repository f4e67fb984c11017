//! Embassy's clock as a [`Timebase`], behind the feature `embassy-time`.
//!
//! For a program with Embassy's executor: a wait costs no processor. Not before the clock's driver has been started, which
//! `embassy_*::init` of the chip's crate does.

use crate::Timebase;
use embassy_time::{Duration, Timer};
use embedded_hal_async::delay::DelayNs;
use stampfly_types::Instant;

/// The program's one clock, as often as drivers want it.
///
/// A wait is never shorter than asked: the tick that is running does not count. With ticks of 1/32768 s it may be 61 µs longer, which a chip
/// on I2C does not mind; where samples are wanted at 400 Hz, let the clock have ticks of a microsecond (feature `tick-hz-1_000_000` of
/// `embassy-time`).
///
/// ```no_run
/// use stampfly_driver_core::{EmbassyClock, Timebase};
/// assert!(EmbassyClock.now() <= EmbassyClock.now());
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct EmbassyClock;

/// The tick that is running, of which nobody knows how much is left.
const RUNNING: Duration = Duration::from_ticks(1);

impl DelayNs for EmbassyClock {
    async fn delay_ns(&mut self, ns: u32) {
        Timer::after(Duration::from_nanos(u64::from(ns)) + RUNNING).await;
    }
    async fn delay_us(&mut self, us: u32) {
        Timer::after(Duration::from_micros(u64::from(us)) + RUNNING).await;
    }
    async fn delay_ms(&mut self, ms: u32) {
        Timer::after(Duration::from_millis(u64::from(ms)) + RUNNING).await;
    }
}

impl Timebase for EmbassyClock {
    fn now(&self) -> Instant {
        Instant::from_micros(embassy_time::Instant::now().as_micros())
    }
}
