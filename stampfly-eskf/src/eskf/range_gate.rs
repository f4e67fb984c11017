//! Plausibility of ranges, tested before the innovation gate.
//!
//! - **Window**: as near as where the vehicle stood, and far from the expected range. Ignored: the
//!   sensor sees its own window because the floor is out of reach. A flying vehicle is never that
//!   near to the floor.
//! - **Leap**: far from both the last and the expected range. Rejected until the next range
//!   confirms it.
//! - **Repetition**: bit-identical values. Ignored from the fifth one on, because such a sensor
//!   measures no climb.
//! - **Jump**: rejected for the whole lock-out time, and the first rejected range had jumped. The
//!   surface has changed, because no vehicle moves that far between two readings.

use stampfly_types::{Instant, math};

/// Smallest change from the last range that counts as a jump, m.
const JUMP: f32 = 0.15;
/// Smallest change from the last range, and from the expected one, that counts as a leap, m.
const LEAP: f32 = 0.05;
/// Number of standard deviations of the climb rate that are allowed to move the range in addition.
const SIGMAS: f32 = 3.0;
/// Margin for recognising the window, m. A smeared window reflects from nearer than the standing
/// distance, and readings have some millimetres of noise.
const WINDOW: f32 = 0.01;
/// Weight of a reading in the mean standing distance.
const STANDS: f32 = 0.1;
/// Number of repetitions after which a range is ignored: 0.13 s, in which a take-off rises by 4 cm.
const UNUSED: u32 = 4;
/// After a silence of this length, s, a change is motion of the vehicle and not a jump.
const SILENT: f32 = 0.2;

/// Permitted use of a range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Use {
    /// Apply the innovation gate.
    Gate,
    /// Count it as outside the gate.
    Reject,
    /// Do not use it.
    Ignore,
}

/// The last range and its history.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct RangeGate {
    distance: f32,
    /// Prediction for the last range, m.
    expected: f32,
    at: Option<Instant>,
    repeats: u32,
    /// Mean range on the ground, m.
    standing: Option<f32>,
    /// Whether the first of the present series of rejected ranges had jumped.
    jumped: bool,
}

impl RangeGate {
    /// Takes a range of the stationary vehicle, m.
    pub(super) fn stand(&mut self, distance: f32) {
        self.standing = Some(self.standing.map_or(distance, |before| before + STANDS * (distance - before)));
    }

    /// Whether this range, m, is a reflection from the sensor's window. See the head of the file.
    pub(super) fn is_window(&self, distance: f32, expected: f32) -> bool {
        self.standing.is_some_and(|standing| distance < standing + WINDOW) && expected - distance > JUMP
    }

    /// Takes a range and its prediction, m, with the standard deviation of the climb rate, m/s.
    /// `rejecting`: the last range was rejected.
    pub(super) fn step(&mut self, at: Instant, distance: f32, expected: f32, climb_sigma: f32, rejecting: bool) -> Use {
        let silence = self.at.replace(at).map(|last| at.since(last).seconds());
        let free = SIGMAS * climb_sigma * silence.unwrap_or(0.0);
        // The vehicle's own motion is no jump either: it may fall at 5 m/s, or change its lean
        // between two readings.
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

    /// Whether the first of the ranges that are being rejected had jumped.
    pub(super) fn rejects_since_jump(&self) -> bool {
        self.jumped
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// Uses of these ranges, 33 ms apart, where 0.5 m is expected.
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
