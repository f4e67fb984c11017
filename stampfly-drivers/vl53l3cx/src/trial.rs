//! Plausibility of the light mode's first results.
//!
//! Only counts; the driver acts on the verdict in [`Ranging::Automatic`](crate::Ranging). It covers
//! the first measurements after power-on, while the vehicle stands, because the source of the
//! height must not change in flight.

use crate::codec::{RangeStatus, Reading};
use stampfly_types::{Duration, Instant};

/// Number of results after which the verdict is reached: 0.4 s.
const ENOUGH: u8 = 12;
/// Number of valid results, not all equal, after which the light mode counts as plausible.
const CONVINCING: u8 = 3;
/// Number of consecutive measurements that did not arrive in time, after which it counts as
/// implausible.
const SILENCES: u8 = 3;
/// Signal rate of a target, 10⁶ photons a second: the chip's own limit, see
/// [`codec::ranging`](crate::codec::ranging).
const OF_A_TARGET: f32 = 1.0;
/// Time after which the light mode is kept, whatever the results.
const LIMIT: Duration = Duration::from_secs(3);

/// Reason why the results of the light mode are implausible.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Implausible {
    /// Measurements do not arrive: three times in a row none was ready within two periods.
    Silent,
    /// None of twelve results was a measurement: a laser or bias test failed, or the chip could not
    /// compute a distance.
    Failing,
    /// Half of the results had the signal rate of a target, and none was valid.
    Unseen,
    /// All valid distances were identical to the last bit, including their noise and signal rates.
    Frozen,
    /// No target was found, although [one is in range](crate::Ranging::Automatic).
    Blind,
}

/// Verdict of the evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    Plausible,
    Implausible(Implausible),
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Trial {
    /// A target is certain to be in range.
    target: bool,
    /// End of the evaluation, set by the first call.
    until: Option<Instant>,
    results: u8,
    measurements: u8,
    valid: u8,
    bright: u8,
    silences: u8,
    /// The first valid result, and whether another one differed from it.
    first: Option<Reading>,
    varied: bool,
}

impl Trial {
    pub(crate) const fn new(target: bool) -> Self {
        Self {
            target,
            until: None,
            results: 0,
            measurements: 0,
            valid: 0,
            bright: 0,
            silences: 0,
            first: None,
            varied: false,
        }
    }

    /// Adds a result, `None` for a time-out. Returns the verdict once it is reached.
    #[inline(never)]
    pub(crate) fn note(&mut self, now: Instant, result: Option<Reading>) -> Option<Verdict> {
        let until = *self.until.get_or_insert(now + LIMIT);
        // Too few results in time, which is no evidence against the light mode.
        if now > until {
            return Some(Verdict::Plausible);
        }
        let Some(reading) = result else {
            self.silences += 1;
            return (self.silences >= SILENCES).then_some(Verdict::Implausible(Implausible::Silent));
        };
        self.silences = 0;
        self.results += 1;
        self.measurements += u8::from(reading.status().is_measurement());
        self.bright += u8::from(reading.signal_rate >= OF_A_TARGET);
        if reading.status() == RangeStatus::Valid {
            self.valid += 1;
            let first = *self.first.get_or_insert(reading);
            // All values except the number of the measurement.
            self.varied |= Reading { count: first.count, ..reading } != first;
        }
        if self.valid >= CONVINCING && self.varied {
            return Some(Verdict::Plausible);
        }
        (self.results >= ENOUGH).then(|| {
            let reason = if self.measurements == 0 {
                Implausible::Failing
            } else if self.valid >= ENOUGH / 2 && !self.varied {
                Implausible::Frozen
            } else if self.valid == 0 && self.bright >= ENOUGH / 2 {
                Implausible::Unseen
            } else if self.valid == 0 && self.target {
                Implausible::Blind
            } else {
                return Verdict::Plausible;
            };
            Verdict::Implausible(reason)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: Reading = Reading {
        code: 9,
        count: 0,
        detectors: 200.0,
        signal_rate: 8.0,
        ambient_rate: 0.5,
        sigma: 0.002,
        distance: 0.5,
    };

    /// The verdict on these results, one every 33 ms, and their number.
    fn tried(target: bool, result: impl Fn(u8) -> Option<Reading>) -> Option<(u8, Verdict)> {
        let mut trial = Trial::new(target);
        (1..=40).find_map(|number| {
            let now = Instant::from_millis(33 * u64::from(number));
            trial.note(now, result(number)).map(|verdict| (number, verdict))
        })
    }

    fn implausible(after: u8, reason: Implausible) -> Option<(u8, Verdict)> {
        Some((after, Verdict::Implausible(reason)))
    }

    #[test]
    fn distances_with_noise_are_believed_after_three() {
        let noisy = |number: u8| Some(Reading { distance: 0.5 + 0.001 * f32::from(number), count: number, ..GOOD });
        assert_eq!(tried(true, noisy), Some((3, Verdict::Plausible)));
    }

    #[test]
    fn each_kind_of_nonsense_has_its_reason() {
        assert_eq!(tried(false, |_| None), implausible(3, Implausible::Silent));
        assert_eq!(tried(false, |_| Some(Reading { code: 3, ..GOOD })), implausible(12, Implausible::Failing));
        assert_eq!(tried(false, |_| Some(Reading { code: 0, ..GOOD })), implausible(12, Implausible::Failing));
        let frozen = |number| Some(Reading { count: number, ..GOOD });
        assert_eq!(tried(false, frozen), implausible(12, Implausible::Frozen));
        for code in [4, 5, 6, 7, 8, 19] {
            assert_eq!(
                tried(false, |_| Some(Reading { code, ..GOOD })),
                implausible(12, Implausible::Unseen),
                "{code}"
            );
        }
    }

    #[test]
    fn nothing_in_sight_is_nonsense_only_where_something_is_in_reach() {
        let nothing = |_| Some(Reading { code: 4, signal_rate: 0.1, ..GOOD });
        assert_eq!(tried(false, nothing), Some((12, Verdict::Plausible)));
        assert_eq!(tried(true, nothing), implausible(12, Implausible::Blind));
    }

    #[test]
    fn a_measurement_now_and_then_is_no_silence_and_a_single_valid_one_is_no_blindness() {
        let every_third =
            |number: u8| number.is_multiple_of(3).then_some(Reading { signal_rate: 0.1, code: 4, ..GOOD });
        assert_eq!(tried(false, every_third), Some((36, Verdict::Plausible)));
        let once = |number| Some(Reading { code: if number == 7 { 9 } else { 4 }, ..GOOD });
        assert_eq!(tried(true, once), Some((12, Verdict::Plausible)));
    }

    #[test]
    fn nothing_changes_after_three_seconds() {
        let mut trial = Trial::new(true);
        assert_eq!(trial.note(Instant::from_millis(10), None), None);
        assert_eq!(trial.note(Instant::from_millis(20), None), None);
        assert_eq!(trial.note(Instant::from_millis(3_011), None), Some(Verdict::Plausible), "the third, but too late");
    }
}
