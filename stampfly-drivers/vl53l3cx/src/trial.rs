//! Are the light mode's first results what a range finder says, or nonsense? Pure counting; the driver acts on it in
//! [`Ranging::Automatic`](crate::Ranging).
//!
//! It is asked about the first measurements after power-on and never later: a vehicle stands then, and a change of how its height is measured
//! must not happen in flight.

use crate::codec::{RangeStatus, Reading};
use stampfly_types::{Duration, Instant};

/// So many measurements are enough: 0.4 s.
const ENOUGH: u8 = 12;
/// So many valid ones that are not all the same are enough to believe it.
const CONVINCING: u8 = 3;
/// So many times no measurement in time is enough to disbelieve it.
const SILENCES: u8 = 3;
/// Light that is a target's, 10⁶ photons a second: what the chip itself takes for one, [`codec::ranging`](crate::codec::ranging).
const OF_A_TARGET: f32 = 1.0;
/// After this nothing changes any more, whatever was or was not measured.
const LIMIT: Duration = Duration::from_secs(3);

/// Why the light mode's results cannot be right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Implausible {
    /// Measurements do not come: three times in a row none was there within two periods.
    Silent,
    /// None of twelve was a measurement: a laser or bias test failed, or nothing could be computed.
    Failing,
    /// As much light as of a target came back in half of them, and no distance was valid.
    Unseen,
    /// Valid distances that are the same to the last bit, with their noise and light.
    Frozen,
    /// Nothing was seen, though [something is in reach](crate::Ranging::Automatic).
    Blind,
}

/// What came of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    Plausible,
    Implausible(Implausible),
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Trial {
    /// Is something in reach for sure?
    target: bool,
    /// When it is over; from the first call on.
    until: Option<Instant>,
    results: u8,
    measurements: u8,
    valid: u8,
    bright: u8,
    silences: u8,
    /// The first valid one, and whether another was different.
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

    /// Takes note of a result, `None` for none in time. A verdict when there is one.
    #[inline(never)]
    pub(crate) fn note(&mut self, now: Instant, result: Option<Reading>) -> Option<Verdict> {
        let until = *self.until.get_or_insert(now + LIMIT);
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
            // But for its number.
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

    /// The verdict on these results, one every 33 ms, and after how many.
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
