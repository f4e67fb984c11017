//! Which ranges are compared with the estimate at all.
//!
//! | a range that | is |
//! |---|---|
//! | leaps: it is far from the one before and from the expected one | rejected until another one confirms it |
//! | repeats itself | left out from the fifth time on: it measures no climb |
//! | is rejected for the lock-out time, and the first of them jumped | a new surface: no vehicle moves as far between two readings |

use stampfly_types::{Instant, math};

/// Smallest change from the range before that is a jump, m.
const JUMP: f32 = 0.15;
/// Smallest change from the range before, and from the expected range, that is a leap, m.
const LEAP: f32 = 0.05;
/// Number of repetitions after which a range is left out: 0.13 s, in which a take-off rises by 4 cm.
const UNUSED: u32 = 4;
/// After a silence of this length, s, a change is the vehicle's motion and not a jump.
const SILENT: f32 = 0.2;

/// What may be done with a range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Use {
    /// What its test ratio says.
    Gate,
    /// It counts as one that is outside the gate.
    Reject,
    /// Nothing.
    Ignore,
}

/// The last range.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct RangeGate {
    distance: f32,
    /// What was expected, m.
    expected: f32,
    at: Option<Instant>,
    repeats: u32,
    /// The first of those that are being rejected had jumped.
    jumped: bool,
}

impl RangeGate {
    /// Takes a range, and what is expected, m. `rejecting`: the one before was rejected.
    pub(super) fn step(&mut self, at: Instant, distance: f32, expected: f32, rejecting: bool) -> Use {
        let silence = self.at.replace(at).map(|last| at.since(last).seconds());
        // Nor does what the vehicle itself moves by: it falls at 5 m/s, and leans to the other side
        // within two readings.
        let moved = expected - self.expected;
        let change = math::smaller((distance - self.distance).abs(), (distance - self.distance - moved).abs());
        let follows = silence.is_some_and(|silence| silence < SILENT);
        let leaps = follows && change > LEAP && (distance - expected).abs() > LEAP;
        if !rejecting {
            self.jumped = follows && change > JUMP;
        }
        let repeats = distance.to_bits() == self.distance.to_bits();
        self.repeats = if repeats { self.repeats.saturating_add(1) } else { 0 };
        (self.distance, self.expected) = (distance, expected);
        match (self.repeats >= UNUSED, leaps) {
            (true, _) => Use::Ignore,
            (false, true) => Use::Reject,
            (false, false) => Use::Gate,
        }
    }

    /// Did the first of the ranges that are being rejected jump?
    pub(super) fn rejects_since_jump(&self) -> bool {
        self.jumped
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// What is done with these ranges, a thirtieth of a second apart, where half a metre is expected.
    fn uses(ranges: &[f32]) -> Vec<Use> {
        let mut gate = RangeGate::default();
        let step =
            |(n, range): (usize, &f32)| gate.step(Instant::from_micros(33_000 * (n as u64 + 1)), *range, 0.5, false);
        ranges.iter().enumerate().map(step).collect()
    }

    #[test]
    fn a_leap_is_rejected_until_another_range_confirms_it() {
        let used = uses(&[0.5, 0.501, 0.9, 0.901]);
        assert_eq!(used, [Use::Gate, Use::Gate, Use::Reject, Use::Gate]);
    }

    #[test]
    fn what_repeats_itself_is_left_out_until_it_changes() {
        let used = uses(&[0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.501]);
        assert_eq!(used[4..], [Use::Ignore, Use::Ignore, Use::Gate]);
    }
}
