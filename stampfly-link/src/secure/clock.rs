//! The vehicle's clock, and what a station knows of it: how old a frame is, without a common clock.
//!
//! A frame of the vehicle says what its clock is. The station adds the time since, and writes the sum into its own frames. The
//! sum is behind the vehicle's clock by the time the vehicle's frame was on its way, never ahead, so the age that the
//! vehicle finds is never less than the true one: a frame that was held up on its way is found, one that was not is at
//! worst taken for older than it is. Of two estimates the later is the better one.

use stampfly_types::{Duration, Instant};

/// What a frame may be old at most to be used. A kill may be older: see [`Vehicle`](super::Vehicle).
pub const MAX_AGE: Duration = Duration::from_millis(200);
/// What a frame may be ahead at most: steps of the two clocks.
const MAX_AHEAD: Duration = Duration::from_millis(20);
/// One part of this is taken off what a station adds: a crystal is off by 20 parts in a million, two and the cold by less than
/// 100.
const DRIFT: u64 = 10_000;

/// A clock's reading, ms. Wraps around after 49 days.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tick(pub u32);

impl Tick {
    pub const fn of(now: Instant) -> Self {
        Self((now.as_micros() / 1_000) as u32)
    }

    /// How much later this is, ms; negative when it is earlier.
    pub const fn after(self, other: Self) -> i32 {
        self.0.wrapping_sub(other.0) as i32
    }

    /// How old what was sealed then is now. `None` when it was sealed in the future.
    pub fn age(self, now: Instant) -> Option<Duration> {
        let age = i64::from(Self::of(now).after(self)) * 1_000;
        if age < -(MAX_AHEAD.as_micros() as i64) { None } else { Some(Duration::from_micros(age.max(0) as u64)) }
    }
}

/// A station's knowledge of its vehicle's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VehicleClock {
    heard: Instant,
    tick: Tick,
}

impl VehicleClock {
    pub const fn new(heard: Instant, tick: Tick) -> Self {
        Self { heard, tick }
    }

    /// What the vehicle's clock is at least.
    pub const fn read(&self, now: Instant) -> Tick {
        let since = now.since(self.heard).as_micros();
        Tick(self.tick.0.wrapping_add(((since - since / DRIFT) / 1_000) as u32))
    }

    /// Another frame of the vehicle came in.
    pub const fn hear(&mut self, now: Instant, tick: Tick) {
        if tick.after(self.read(now)) >= 0 {
            *self = Self::new(now, tick);
        }
    }
}
