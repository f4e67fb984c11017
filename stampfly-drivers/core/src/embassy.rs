//! [`EmbassyClock`]: Embassy's clock as a [`Timebase`], behind the feature `embassy-time`.
//!
//! For a program on Embassy's executor, where a wait frees the processor. The time driver must have
//! been started first, which `embassy_*::init` of the microcontroller's crate does.

use crate::Timebase;
use embassy_time::{Duration, Timer};
use embedded_hal_async::delay::DelayNs;
use stampfly_types::Instant;

/// The time of Embassy's global time driver. Every driver can have its own copy.
///
/// A wait is never shorter than requested: it is extended by one tick, because the current tick is
/// already running. With ticks of 1/32768 s a wait can be 61 µs longer than requested, which does
/// not matter to a chip on I2C. For samples at 400 Hz use ticks of a microsecond (feature
/// `tick-hz-1_000_000` of `embassy-time`).
///
/// ```no_run
/// use stampfly_driver_core::{EmbassyClock, Timebase};
/// assert!(EmbassyClock.now() <= EmbassyClock.now());
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct EmbassyClock;

/// Compensates for the current tick, an unknown part of which has already passed.
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
