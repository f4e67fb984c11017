//! The motion of the last tenth of a second, to reconstruct the state at the time of a late
//! measurement.
//!
//! A flow sensor reports one or two frames late, a camera system about 50 ms late. The ring stores
//! rotation and velocity changes, not states, so that a correction of the present state also
//! corrects the past ones without touching the ring. (Velocity changes keep the attitude with which
//! they were added: a correction by θ leaves an error of θ times the change until they are
//! dropped.) Samples faster than 2.4 ms are merged, so the ring covers [`MAX_AGE`] at any sample
//! rate.
//!
//! For a satellite receiver that is 300 ms late, [`History::reaching`] covers a longer time in the
//! same 2.1 kB by merging more. Within a merged interval, rate and force count as constant.
//!
//! | horizon | merges up to | use |
//! |---|---|---|
//! | 0.1 s | 2.4 ms | flow, cameras |
//! | 0.3 s | 6.5 ms | receivers at 10 Hz and more, slow turns between flow samples |
//! | 0.5 s | 11 ms | any receiver; rotation within a frame is lost for flow |

use super::PropagationStep;
use super::state::{Motion, Rotation, conjugate, multiply, normalize, rotate, small_rotation};
use stampfly_types::Vec3;

/// Age that the default history covers, s.
pub const MAX_AGE: f32 = 0.1;
/// Shortest interval, s; a shorter one takes in the next sample. Slightly less than the 2.5 ms of
/// 400 Hz, for clocks that run fast.
const MIN_INTERVAL: f32 = 2.4e-3;
/// Number of intervals. All but the one being filled must cover [`MAX_AGE`].
const DEPTH: usize = 48;
const _: () = assert!((DEPTH - 1) as f32 * MIN_INTERVAL > MAX_AGE);

/// An interval of time and the motion in it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Interval {
    length: f32,
    /// Mean rate without bias, body, rad/s.
    rate: Vec3,
    /// Rotation from the first sample to the end of this interval. Two of them give the rotation in
    /// between without a product over the intervals.
    turned: [f32; 4],
    /// World, m/s.
    delta_velocity: Vec3,
}

const EMPTY: Interval = Interval {
    length: 0.0,
    rate: Vec3::new(0.0, 0.0, 0.0),
    turned: [1.0, 0.0, 0.0, 0.0],
    delta_velocity: Vec3::new(0.0, 0.0, 0.0),
};

/// Shortest interval of a history that covers `horizon`, s. One interval of the ring is still being
/// filled.
fn merged(horizon: f32) -> f32 {
    MIN_INTERVAL.max(horizon / (DEPTH - 2) as f32)
}

/// Ring of the most recent motion. See the [module](self) documentation.
///
/// ```
/// use stampfly_eskf::filter::{History, NominalState};
/// use stampfly_types::Vec3;
/// let (mut state, mut history) = (NominalState::default(), History::default());
/// for _ in 0..10 {
///     history.add(&state.propagate(&Vec3::new(0.0, 0.0, -9.80665), &Vec3::x(), 0.0025));
/// }
/// // 20 ms ago the body had turned 5 mrad.
/// let then = history.since(0.02).unwrap().state_at_start(&state);
/// assert!((then.quat().angle() - 0.005).abs() < 1e-5);
/// assert!((history.mean_rate(0.0, 0.01).unwrap() - Vec3::x()).amax() < 1e-5);
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct History {
    #[cfg_attr(feature = "serde", serde(with = "stored::intervals"))]
    intervals: [Interval; DEPTH],
    /// Shortest interval, s; a shorter one takes in the next sample.
    merged: f32,
    #[cfg_attr(feature = "serde", serde(deserialize_with = "stored::place"))]
    newest: usize,
}

impl Default for History {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl History {
    /// An empty history. A constant, because a small stack has no room for a temporary one.
    pub(crate) const EMPTY: Self = Self { intervals: [EMPTY; DEPTH], merged: MIN_INTERVAL, newest: 0 };

    /// An empty history that covers `horizon` seconds, at least 0.1. A longer one has the same size
    /// and is coarser.
    ///
    /// ```
    /// use stampfly_eskf::filter::{History, NominalState};
    /// use stampfly_types::Vec3;
    /// let (mut state, mut history) = (NominalState::default(), History::reaching(0.5));
    /// for _ in 0..8_000 {
    ///     history.add(&state.propagate(&Vec3::new(1.0, 0.0, -9.80665), &Vec3::zeros(), 1.25e-4));
    /// }
    /// // Half a second ago, at 8 kHz.
    /// let then = history.since(0.5).unwrap().state_at_start(&state);
    /// assert!((then.velocity.x - 0.5).abs() < 1e-3);
    /// ```
    #[must_use]
    pub fn reaching(horizon: f32) -> Self {
        Self { merged: merged(horizon), ..Self::EMPTY }
    }

    /// Does in place what [`reaching`](Self::reaching) does.
    pub(crate) fn reach(&mut self, horizon: f32) {
        self.clear();
        self.merged = merged(horizon);
    }

    /// Drops all samples.
    pub fn clear(&mut self) {
        self.intervals.fill(EMPTY);
        self.newest = 0;
    }

    /// Rotates the stored velocity changes in the world, after the heading has been set.
    pub(crate) fn turn(&mut self, rotation: &Rotation) {
        for interval in &mut self.intervals {
            interval.delta_velocity = rotate(rotation, &interval.delta_velocity);
        }
    }

    /// Appends the motion of one inertial sample.
    #[inline]
    pub fn add(&mut self, motion: &Motion) {
        if let Some(newest) = self.intervals.get_mut(self.newest)
            && newest.length < self.merged
        {
            let length = newest.length + motion.dt;
            newest.rate = (newest.rate * newest.length + motion.rate * motion.dt) / length;
            newest.turned = multiply(newest.turned, motion.delta_rotation);
            newest.delta_velocity += motion.delta_velocity;
            newest.length = length;
            return;
        }
        // Normalised once per interval, against the drift of the running product.
        let turned = normalize(multiply(self.turned(), motion.delta_rotation));
        self.newest = if self.newest + 1 < DEPTH { self.newest + 1 } else { 0 };
        if let Some(place) = self.intervals.get_mut(self.newest) {
            *place = Interval { length: motion.dt, rate: motion.rate, turned, delta_velocity: motion.delta_velocity };
        }
    }

    /// Filled intervals, newest first.
    #[inline]
    fn backwards(&self) -> impl Iterator<Item = &Interval> {
        let all = (&self.intervals[..], &[][..]);
        let (older, newer) = self.intervals.split_at_checked(self.newest + 1).unwrap_or(all);
        older.iter().rev().chain(newer.iter().rev()).take_while(|interval| interval.length > 0.0)
    }

    /// The step over the last `age` seconds; for a negative age, an extrapolation of the last
    /// motion. `None` when the history does not reach back so far.
    #[inline]
    #[must_use]
    pub fn since(&self, age: f32) -> Option<PropagationStep> {
        let mut step = PropagationStep::default();
        for interval in self.backwards() {
            let left = age - step.duration;
            if left > interval.length {
                step.prepend(interval.length, interval.delta_velocity);
                continue;
            }
            // The oldest interval is used in part, with constant rate and force.
            step.prepend(left, interval.delta_velocity * (left / interval.length));
            let to_end = multiply(conjugate(interval.turned), self.turned());
            step.delta_rotation = multiply(small_rotation(interval.rate * left), to_end);
            return Some(step);
        }
        None
    }

    /// Rotation from the first sample to the present.
    #[inline]
    fn turned(&self) -> [f32; 4] {
        self.intervals.get(self.newest).unwrap_or(&EMPTY).turned
    }

    /// Mean rate without bias over the `length` seconds that ended `age` seconds ago, body, rad/s,
    /// over the part that the history covers. `None` when it covers no part.
    #[inline]
    #[must_use]
    pub fn mean_rate(&self, age: f32, length: f32) -> Option<Vec3> {
        let (mut sum, mut time, mut end) = (Vec3::zeros(), 0.0, 0.0f32);
        for interval in self.backwards() {
            let begin = end + interval.length;
            // Comparisons instead of `min` and `max`, which are calls on cores whose FPU has
            // neither.
            let from = if end > age { end } else { age };
            let to = if begin < age + length { begin } else { age + length };
            let overlap = to - from;
            if overlap > 0.0 {
                sum += interval.rate * overlap;
                time += overlap;
            }
            if begin >= age + length {
                break;
            }
            end = begin;
        }
        (time > 1e-5).then(|| sum / time)
    }
}

/// Serialisation that serde does not derive.
#[cfg(feature = "serde")]
mod stored {
    use super::{DEPTH, EMPTY, Interval};
    use core::fmt;
    use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Visitor};

    /// Index of an interval; a number out of range is an error.
    pub fn place<'de, D: Deserializer<'de>>(deserializer: D) -> Result<usize, D::Error> {
        let place = usize::deserialize(deserializer)?;
        if place < DEPTH { Ok(place) } else { Err(D::Error::custom("beyond the memory of the last tenth of a second")) }
    }

    /// Arrays of more than 32 elements.
    pub mod intervals {
        use super::*;
        use serde::ser::{SerializeTuple, Serializer};

        pub fn serialize<S: Serializer>(intervals: &[Interval; DEPTH], serializer: S) -> Result<S::Ok, S::Error> {
            let mut tuple = serializer.serialize_tuple(DEPTH)?;
            intervals.iter().try_for_each(|interval| tuple.serialize_element(interval))?;
            tuple.end()
        }

        pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[Interval; DEPTH], D::Error> {
            deserializer.deserialize_tuple(DEPTH, All)
        }
    }

    struct All;

    impl<'de> Visitor<'de> for All {
        type Value = [Interval; DEPTH];

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "{DEPTH} intervals")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Self::Value, A::Error> {
            let mut intervals = [EMPTY; DEPTH];
            for (index, interval) in intervals.iter_mut().enumerate() {
                *interval = sequence.next_element()?.ok_or_else(|| A::Error::invalid_length(index, &self))?;
            }
            Ok(intervals)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::NominalState;
    use approx::assert_abs_diff_eq;
    use proptest::prelude::*;

    /// Uniform angular acceleration of 1 rad/s², sampled at `rate`: state, history and time after
    /// about 0.3 s.
    fn spun_up(rate: f32) -> (NominalState, History, f32) {
        let (mut state, mut history) = (NominalState::default(), History::default());
        let dt = 1.0 / rate;
        let steps = (0.3 * rate) as u32;
        for step in 0..steps {
            let gyro = Vec3::x() * ((step as f32 + 0.5) * dt);
            history.add(&state.propagate(&Vec3::new(0.3, 0.0, -9.8), &gyro, dt));
        }
        (state, history, steps as f32 * dt)
    }

    proptest! {
        #[test]
        fn the_history_covers_a_tenth_of_a_second_at_any_sample_rate(
            rate in prop::sample::select(&[100f32, 200.0, 385.0, 400.0, 415.0, 800.0, 1000.0, 1600.0, 8000.0][..]),
            age in 0.0f32..MAX_AGE,
        ) {
            let (state, history, now) = spun_up(rate);
            let step = history.since(age);
            prop_assert!(step.is_some(), "{age} s at {rate} Hz");
            let step = step.unwrap();
            prop_assert!((step.duration - age).abs() < 1e-6);
            let then = now - age;
            let roll = 2.0 * stampfly_types::math::asin(step.state_at_start(&state).attitude[1]);
            prop_assert!((roll - 0.5 * then * then).abs() < 1e-4, "{roll} rad, {age} s ago at {rate} Hz");
        }

        #[test]
        fn mean_rate_of_a_constant_acceleration_is_exact(age in 0.0f32..0.08, length in 0.004f32..0.02) {
            let (_, history, now) = spun_up(400.0);
            let expected = now - age - 0.5 * length;
            let mean = history.mean_rate(age, length).expect("covered").x;
            // Within a step the rate counts as constant.
            prop_assert!((mean - expected).abs() < 0.0013, "{mean}, not {expected}");
        }
    }

    #[test]
    fn times_before_the_history_give_none() {
        let history = History::default();
        assert!(history.since(0.01).is_none() && history.mean_rate(0.0, 0.01).is_none());
        let (_, history, _) = spun_up(400.0);
        assert!(history.since(0.2).is_none() && history.mean_rate(0.2, 0.01).is_none());
    }

    #[test]
    fn a_negative_age_extrapolates_the_last_motion() {
        let (state, history, _) = spun_up(400.0);
        let ahead = history.since(-0.01).expect("covered").state_at_start(&state);
        assert_abs_diff_eq!(ahead.attitude[1] - state.attitude[1], 0.5 * 0.01 * 0.3, epsilon = 1e-4);
        assert_abs_diff_eq!(ahead.velocity.x - state.velocity.x, 0.003, epsilon = 1e-4);
    }
}
