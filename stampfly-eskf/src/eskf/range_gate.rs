//! Which ranges are compared with the estimate at all.
//!
//! | a range that | is |
//! |---|---|
//! | is as near as where the vehicle stands, far from the expected one | left out: no floor comes so near to a vehicle that flies. It is the sensor's window, where the floor is out of reach |
//! | leaps: it is far from the one before and from the expected one | rejected until another one confirms it |
//! | repeats itself | left out from the fifth time on: it measures no climb |
//! | is rejected for the lock-out time, and the first of them jumped | a new surface: no vehicle moves as far between two readings |

use stampfly_types::{Instant, math};

/// Smallest change from the range before that is a jump, m.
const JUMP: f32 = 0.15;
/// Smallest change from the range before, and from the expected range, that is a leap, m.
const LEAP: f32 = 0.05;
/// What the climb rate may be wrong by, in standard deviations, moves the range as well.
const SIGMAS: f32 = 3.0;
/// A window that is smeared sends its light back from nearer than where the vehicle stands, and is
/// read with noise of some millimetres, m.
const WINDOW: f32 = 0.01;
/// Weight of a reading in the range of a vehicle that stands.
const STANDS: f32 = 0.1;
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
    /// What is measured where the vehicle stands, m.
    standing: Option<f32>,
    /// The first of those that are being rejected had jumped.
    jumped: bool,
}

impl RangeGate {
    /// Takes a range of a vehicle that stands, m.
    pub(super) fn stand(&mut self, distance: f32) {
        self.standing = Some(self.standing.map_or(distance, |before| before + STANDS * (distance - before)));
    }

    /// Is it the sensor's window that this range, m, measures? See the head of the file.
    pub(super) fn is_window(&self, distance: f32, expected: f32) -> bool {
        self.standing.is_some_and(|standing| distance < standing + WINDOW) && expected - distance > JUMP
    }

    /// Takes a range, and what is expected, m, with the standard deviation of the climb rate, m/s.
    /// `rejecting`: the one before was rejected.
    pub(super) fn step(&mut self, at: Instant, distance: f32, expected: f32, climb_sigma: f32, rejecting: bool) -> Use {
        let silence = self.at.replace(at).map(|last| at.since(last).seconds());
        let free = SIGMAS * climb_sigma * silence.unwrap_or(0.0);
        // Nor does what the vehicle itself moves by: it falls at 5 m/s, and leans to the other side
        // within two readings.
        let moved = expected - self.expected;
        let change = math::smaller((distance - self.distance).abs(), (distance - self.distance - moved).abs());
        let follows = silence.is_some_and(|silence| silence < SILENT);
        let leaps = follows && change > LEAP + free && (distance - expected).abs() > LEAP;
        if !rejecting {
            self.jumped = follows && change > JUMP + free;
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
        let step = |(n, range): (usize, &f32)| {
            gate.step(Instant::from_micros(33_000 * (n as u64 + 1)), *range, 0.5, 0.05, false)
        };
        ranges.iter().enumerate().map(step).collect()
    }

    #[test]
    fn a_leap_is_rejected_until_another_range_confirms_it() {
        let used = uses(&[0.5, 0.501, 0.9, 0.901]);
        assert_eq!(used, [Use::Gate, Use::Gate, Use::Reject, Use::Gate]);
    }

    #[test]
    fn after_a_reset_the_fall_that_was_not_known_is_no_leap() {
        let falls = |climb_sigma: f32| {
            let mut gate = RangeGate::default();
            let mut leaps = 0;
            for n in 1..10u8 {
                let fallen = 1.0 - 2.0 * 0.033 * f32::from(n);
                let used = gate.step(Instant::from_micros(33_000 * u64::from(n)), fallen, 1.0, climb_sigma, false);
                leaps += u32::from(used == Use::Reject);
            }
            leaps
        };
        assert!(falls(0.05) > 6, "of a climb rate that is known");
        assert_eq!(falls(1.0), 0, "of one that is not");
    }

    #[test]
    fn a_range_as_near_as_where_it_stood_is_the_window_in_the_air_and_the_floor_on_it() {
        let mut gate = RangeGate::default();
        (0..30).for_each(|_| gate.stand(0.028));
        assert!(gate.is_window(0.020, 1.5) && gate.is_window(0.030, 0.5));
        assert!(!gate.is_window(0.028, 0.05) && !gate.is_window(0.2, 1.5));
        assert!(!RangeGate::default().is_window(0.02, 1.5), "one that has not stood knows nothing");
    }

    #[test]
    fn what_repeats_itself_is_left_out_until_it_changes() {
        let used = uses(&[0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.501]);
        assert_eq!(used[4..], [Use::Ignore, Use::Ignore, Use::Gate]);
    }
}
