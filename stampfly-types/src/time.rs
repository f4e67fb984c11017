//! Time as an argument.
//!
//! Nothing below the firmware package reads a clock: every step is told what time it is. [`Micros`] counts
//! microseconds since power-on in 64 bits, because 32 bits wrap after 71.6 minutes, in flight.

use core::fmt;
use core::ops::{Add, AddAssign};

/// Microseconds: an instant since power-on, or the length of a span.
///
/// Subtraction is only offered as [`Micros::since`], which saturates: a stamp that lies in the future is
/// "no time ago" instead of 584,000 years ago.
///
/// ```
/// use stampfly_types::Micros;
/// let sampled = Micros::from_millis(100);
/// let now = sampled + Micros(2_500);
/// assert_eq!(now.since(sampled), Micros(2_500));
/// assert_eq!(sampled.since(now), Micros::ZERO);
/// assert_eq!(now.since(sampled).seconds(), 0.0025);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Micros(pub u64);

impl Micros {
    /// Power-on, or no time at all.
    pub const ZERO: Self = Self(0);

    /// A number of milliseconds.
    #[must_use]
    pub const fn from_millis(millis: u64) -> Self {
        Self(millis.saturating_mul(1_000))
    }

    /// A number of seconds.
    #[must_use]
    pub const fn from_secs(secs: u64) -> Self {
        Self(secs.saturating_mul(1_000_000))
    }

    /// A span in seconds, rounded to the microsecond. Negative and NaN give zero.
    #[must_use]
    pub fn from_seconds(seconds: f32) -> Self {
        // `as` saturates and maps NaN to zero, which is exactly what is promised.
        Self((f64::from(seconds) * 1e6 + 0.5) as u64)
    }

    /// The span from `earlier` to `self`; zero when `earlier` lies in the future.
    #[must_use]
    pub const fn since(self, earlier: Self) -> Self {
        Self(self.0.saturating_sub(earlier.0))
    }

    /// A span in seconds. Exact to one part in 2²⁴: use it for differences, never for absolute time.
    #[must_use]
    pub fn seconds(self) -> f32 {
        // The same number, in one instruction where 32 bits are a register.
        let micros = match u32::try_from(self.0) {
            Ok(micros) => micros as f32,
            Err(_) => self.0 as f32,
        };
        micros * 1e-6
    }

    /// The instant in seconds with microsecond resolution, for display and logs.
    #[must_use]
    pub fn seconds_f64(self) -> f64 {
        self.0 as f64 * 1e-6
    }

    /// The signed difference `self − other` in seconds.
    #[must_use]
    pub fn signed_seconds_since(self, other: Self) -> f32 {
        if self >= other { self.since(other).seconds() } else { -other.since(self).seconds() }
    }
}

impl Add for Micros {
    type Output = Self;
    fn add(self, span: Self) -> Self {
        Self(self.0.saturating_add(span.0))
    }
}

impl AddAssign for Micros {
    fn add_assign(&mut self, span: Self) {
        *self = *self + span;
    }
}

impl fmt::Display for Micros {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{:06} s", self.0 / 1_000_000, self.0 % 1_000_000)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn since_undoes_add_and_never_wraps(start: u64, span in 0u64..1 << 60) {
            let later = Micros(start) + Micros(span);
            prop_assert!(later.since(Micros(start)) <= Micros(span));
            prop_assert_eq!(Micros(start).since(later), Micros::ZERO);
        }

        #[test]
        fn seconds_round_trip(micros in 0u64..10_000_000) {
            let back = Micros::from_seconds(Micros(micros).seconds());
            prop_assert!(back.0.abs_diff(micros) <= 1);
        }
    }

    #[test]
    fn hostile_seconds_are_harmless() {
        assert_eq!(Micros::from_seconds(f32::NAN), Micros::ZERO);
        assert_eq!(Micros::from_seconds(-1.0), Micros::ZERO);
        assert_eq!(Micros::from_seconds(f32::INFINITY), Micros(u64::MAX));
    }
}
