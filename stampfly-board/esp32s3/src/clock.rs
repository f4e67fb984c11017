//! The time of the vehicle: microseconds since power-on, from the chip's 64-bit counter.

use embassy_time::Timer;
use embedded_hal_async::delay::DelayNs;
use stampfly_drivers::Timebase;
use stampfly_types::{Duration, Instant};

/// Waits shorter than this are spent waiting: putting a task to sleep and waking it costs about as much.
const SHORT: Duration = Duration::from_micros(10);

/// The vehicle's clock. There is one counter; every copy reads it.
#[derive(Clone, Copy, Debug)]
pub struct Clock;

impl Timebase for Clock {
    fn now(&self) -> Instant {
        Instant::from_micros(esp_hal::time::Instant::now().duration_since_epoch().as_micros())
    }
}

impl DelayNs for Clock {
    async fn delay_ns(&mut self, ns: u32) {
        let span = Duration::from_micros(u64::from(ns.div_ceil(1_000)));
        if span >= SHORT {
            return Timer::after_micros(span.as_micros()).await;
        }
        // One more, because the present microsecond has already begun.
        let end = self.now() + span + Duration::from_micros(1);
        while self.now() < end {
            core::hint::spin_loop();
        }
    }
}
