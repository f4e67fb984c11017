//! Instants and durations.
//!
//! Only the firmware package reads a clock: every step gets the time as an argument, an
//! [`Instant`]. The difference of two instants is a [`Duration`]: a period, a deadline, a budget,
//! the age of a sample. They are two types, because a stamp compared with a timeout compiles when
//! both are numbers.
//!
//! | | `+ Instant` | `+ Duration` | `- Instant` | `- Duration` |
//! |---|---|---|---|---|
//! | [`Instant`] | does not compile | [`Instant`] | [`Instant::since`] | [`Instant`] |
//! | [`Duration`] | does not compile | [`Duration`] | does not compile | [`Duration`] |
//!
//! Both count microseconds in 64 bits, which last 584,000 years. The 32 bits of other firmware wrap
//! after 71.6 minutes, in flight. All arithmetic saturates: no operator panics or wraps. The type
//! is not `core::time::Duration`, whose 96 bits of seconds and nanoseconds panic on overflow.

use core::fmt;
use core::ops::{Add, AddAssign, Div, Mul, Sub};

const MICROS_PER_MILLI: u64 = 1_000;
const MICROS_PER_SECOND: u64 = 1_000_000;

/// A point in time, counted in microseconds since power-on.
///
/// Instants have no `-` operator for each other. [`Instant::since`] returns the difference and
/// saturates: the age of a stamp in the future is zero instead of 584,000 years.
///
/// ```
/// use stampfly_types::{Duration, Instant};
/// let sampled = Instant::from_millis(100);
/// let now = sampled + Duration::from_micros(2_500);
/// assert_eq!(now.as_micros(), 102_500);
/// assert_eq!(now.since(sampled), Duration::from_micros(2_500));
/// assert_eq!(sampled.since(now), Duration::ZERO);
/// assert_eq!(now.to_string(), "0.102500 s");
/// ```
///
/// Two instants cannot be added or subtracted, and an instant is not a duration:
///
/// ```compile_fail,E0277
/// use stampfly_types::Instant;
/// let sum = Instant::from_secs(1) + Instant::from_secs(2);
/// ```
/// ```compile_fail,E0277
/// use stampfly_types::Instant;
/// let difference = Instant::from_secs(2) - Instant::from_secs(1);
/// ```
/// ```compile_fail,E0308
/// use stampfly_types::{Duration, Instant};
/// let timeout: Duration = Instant::from_secs(2);
/// ```
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Instant(Duration);

impl fmt::Debug for Instant {
    /// Like a duration, under its own name: `Instant(2500)`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Instant").field(&self.as_micros()).finish()
    }
}

impl Instant {
    /// Power-on.
    pub const ZERO: Self = Self(Duration::ZERO);
    /// The latest instant, 584,000 years after power-on: "never" for a deadline.
    pub const MAX: Self = Self(Duration::MAX);

    /// The instant `micros` microseconds after power-on.
    #[must_use]
    pub const fn from_micros(micros: u64) -> Self {
        Self(Duration::from_micros(micros))
    }

    /// The instant `millis` milliseconds after power-on.
    #[must_use]
    pub const fn from_millis(millis: u64) -> Self {
        Self(Duration::from_millis(millis))
    }

    /// The instant `secs` seconds after power-on.
    #[must_use]
    pub const fn from_secs(secs: u64) -> Self {
        Self(Duration::from_secs(secs))
    }

    /// Microseconds since power-on.
    #[must_use]
    pub const fn as_micros(self) -> u64 {
        self.0.as_micros()
    }

    /// The time from `earlier` to `self`; zero when `earlier` is later than `self`.
    #[must_use]
    pub const fn since(self, earlier: Self) -> Duration {
        self.0.less(earlier.0)
    }

    /// The difference `self − other` in seconds, with its sign.
    #[must_use]
    pub fn signed_seconds_since(self, other: Self) -> f32 {
        if self >= other { self.since(other).seconds() } else { -other.since(self).seconds() }
    }

    /// Seconds since power-on as `f64`, for display and logs.
    #[must_use]
    pub fn seconds_f64(self) -> f64 {
        self.0.seconds_f64()
    }
}

/// A length of time in microseconds, never negative.
///
/// ```
/// use stampfly_types::Duration;
/// let period = Duration::from_micros(2_500);
/// assert_eq!(period.seconds(), 0.0025);
/// assert_eq!(period * 400, Duration::from_secs(1));
/// assert_eq!(period / 2, Duration::from_micros(1_250));
/// assert_eq!(period - Duration::from_millis(3), Duration::ZERO);
/// assert_eq!(Duration::from_seconds(0.0025), period);
/// assert_eq!(period.to_string(), "0.002500 s");
/// ```
///
/// An instant plus a duration is an instant. Only durations can be added to a duration:
///
/// ```compile_fail,E0308
/// use stampfly_types::{Duration, Instant};
/// let later = Duration::from_secs(2) + Instant::from_secs(1);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Duration(u64);

impl Duration {
    /// No time.
    pub const ZERO: Self = Self(0);
    /// The longest duration, 584,000 years.
    pub const MAX: Self = Self(u64::MAX);

    /// A duration of `micros` microseconds.
    #[must_use]
    pub const fn from_micros(micros: u64) -> Self {
        Self(micros)
    }

    /// A duration of `millis` milliseconds.
    #[must_use]
    pub const fn from_millis(millis: u64) -> Self {
        Self(millis.saturating_mul(MICROS_PER_MILLI))
    }

    /// A duration of `secs` seconds.
    #[must_use]
    pub const fn from_secs(secs: u64) -> Self {
        Self(secs.saturating_mul(MICROS_PER_SECOND))
    }

    /// A duration in seconds, rounded to the microsecond. Zero for negative numbers and NaN.
    #[must_use]
    pub fn from_seconds(seconds: f32) -> Self {
        // The cast saturates and maps NaN to zero.
        Self((f64::from(seconds) * 1e6 + 0.5) as u64)
    }

    /// The duration in microseconds.
    #[must_use]
    pub const fn as_micros(self) -> u64 {
        self.0
    }

    /// The duration in whole milliseconds, rounded down.
    #[must_use]
    pub const fn as_millis(self) -> u64 {
        self.0 / MICROS_PER_MILLI
    }

    /// The duration in seconds, accurate to one part in 2²⁴.
    #[must_use]
    pub fn seconds(self) -> f32 {
        // Converts two halves: FPUs convert 32 bits in one instruction, while 64 bits are a call of
        // 40 instructions. During the first 71 minutes the result equals that of the whole number.
        let [low, high] = [self.0 as u32, (self.0 >> 32) as u32];
        (high as f32 * 4_294_967_296.0 + low as f32) * 1e-6
    }

    /// The duration in seconds as `f64`, for display and logs.
    #[must_use]
    pub fn seconds_f64(self) -> f64 {
        self.0 as f64 * 1e-6
    }

    /// The saturating difference. Operators cannot be `const`.
    const fn less(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }
}

impl Add<Duration> for Instant {
    type Output = Self;
    fn add(self, duration: Duration) -> Self {
        Self(self.0 + duration)
    }
}

impl AddAssign<Duration> for Instant {
    fn add_assign(&mut self, duration: Duration) {
        *self = *self + duration;
    }
}

/// Saturates at power-on.
impl Sub<Duration> for Instant {
    type Output = Self;
    fn sub(self, duration: Duration) -> Self {
        Self(self.0 - duration)
    }
}

impl Add for Duration {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }
}

impl AddAssign for Duration {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

/// Saturates at zero.
impl Sub for Duration {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.less(other)
    }
}

impl Mul<u64> for Duration {
    type Output = Self;
    fn mul(self, factor: u64) -> Self {
        Self(self.0.saturating_mul(factor))
    }
}

/// Rounds down. Division by zero returns [`Duration::MAX`].
impl Div<u64> for Duration {
    type Output = Self;
    fn div(self, divisor: u64) -> Self {
        Self(self.0.checked_div(divisor).unwrap_or(u64::MAX))
    }
}

impl fmt::Display for Instant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl fmt::Display for Duration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{:06} s", self.0 / MICROS_PER_SECOND, self.0 % MICROS_PER_SECOND)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::string::ToString;

    proptest! {
        #[test]
        fn since_undoes_add_and_never_wraps(start: u64, span in 0u64..1 << 60) {
            let (start, span) = (Instant::from_micros(start), Duration::from_micros(span));
            let later = start + span;
            prop_assert!(later.since(start) <= span);
            prop_assert!(later == Instant::MAX || later.since(start) == span);
            prop_assert_eq!(start.since(later), Duration::ZERO);
        }

        #[test]
        fn arithmetic_saturates(a: u64, b: u64, factor in prop_oneof![0..10u64, any::<u64>()]) {
            let (instant, x, y) = (Instant::from_micros(a), Duration::from_micros(a), Duration::from_micros(b));
            prop_assert_eq!((instant + y).as_micros(), a.saturating_add(b));
            prop_assert_eq!((instant - y).as_micros(), a.saturating_sub(b));
            prop_assert_eq!((x + y).as_micros(), a.saturating_add(b));
            prop_assert_eq!((x - y).as_micros(), a.saturating_sub(b));
            prop_assert_eq!((x * factor).as_micros(), a.saturating_mul(factor));
            prop_assert_eq!((x / factor).as_micros(), a.checked_div(factor).unwrap_or(u64::MAX));
        }

        #[test]
        fn signed_difference_changes_its_sign(a in 0u64..1 << 40, b in 0u64..1 << 40) {
            let [a, b] = [a, b].map(Instant::from_micros);
            prop_assert_eq!(a.signed_seconds_since(b), -b.signed_seconds_since(a));
            prop_assert_eq!(a.signed_seconds_since(b) > 0.0, a > b);
        }

        #[test]
        fn seconds_round_trip(micros in 0u64..10_000_000) {
            let back = Duration::from_seconds(Duration::from_micros(micros).seconds());
            prop_assert!(back.as_micros().abs_diff(micros) <= 1);
        }

        #[test]
        fn seconds_of_any_length_are_as_exact(bits in 0u32..64, micros in any::<u64>()) {
            let duration = Duration::from_micros(micros >> bits);
            let exact = duration.seconds_f64();
            prop_assert!((f64::from(duration.seconds()) - exact).abs() <= 2e-7 * exact, "{duration}");
        }
    }

    #[test]
    fn hostile_seconds_are_harmless() {
        assert_eq!(Duration::from_seconds(f32::NAN), Duration::ZERO);
        assert_eq!(Duration::from_seconds(-1.0), Duration::ZERO);
        assert_eq!(Duration::from_seconds(f32::INFINITY), Duration::MAX);
    }

    #[test]
    fn units_agree() {
        assert_eq!(Instant::from_secs(3), Instant::from_millis(3_000));
        assert_eq!(Instant::from_millis(3), Instant::from_micros(3_000));
        assert_eq!(Duration::from_secs(3), Duration::from_micros(3_000_000));
        assert_eq!(Duration::from_micros(2_999).as_millis(), 2);
        assert_eq!(Instant::from_secs(u64::MAX), Instant::MAX);
        assert_eq!(Instant::from_micros(1_250_000).seconds_f64(), 1.25);
        assert_eq!(Instant::from_micros(61_000_002).to_string(), "61.000002 s");
    }
}
