//! Is the height that is flown by one, or has the estimate lost it?
//!
//! An estimator weighs the barometer against what its inertial sensor makes of the way. When that
//! is far off (an attitude that is wrong by half a turn, an accelerometer that is), it takes the
//! barometer for the one that is wrong, and its height runs away by kilometres. Beside it stand two
//! heights that nobody integrates: the air's pressure, and the receiver's. An estimate that
//! contradicts all of those that are there is none.
//!
//! Not for a few metres: pressure drifts with the weather, and a receiver's height wanders.

use stampfly_types::math::larger;
use stampfly_types::{Duration, Instant};

/// Farther than this, m, a height contradicts another: a receiver's wanders by 10 m, and pressure
/// drifts by 8 m an hour with the weather and as much with a sensor in the sun.
const APART: f32 = 30.0;
/// For this long. An estimator that is reset to a sensor is there within a second or two.
const LASTS: Duration = Duration::from_secs(5);
/// What was measured longer ago says nothing.
const FRESH: Duration = Duration::from_secs(2);

/// A height above home, m, and when it was measured.
pub type Height = Option<(Instant, f32)>;

/// What is remembered.
///
/// ```
/// use stampfly_fixed_wing::heights::Heights;
/// use stampfly_types::Instant;
/// let mut heights = Heights::default();
/// let lost = |second: &u64| {
///     let now = Instant::from_secs(*second);
///     heights.step(now, 500.0, Some((now, 41.0)), Some((now, 38.0)))
/// };
/// assert_eq!((0..20).find(lost), Some(5));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Heights {
    since: Option<Instant>,
}

impl Heights {
    /// Takes the height of the estimate, m above home, and the newest of barometer and receiver.
    /// Has it been lost?
    pub fn step(&mut self, now: Instant, estimated: f32, barometer: Height, receiver: Height) -> bool {
        let fresh = |height: Height| height.filter(|(at, _)| now.since(*at) < FRESH).map(|(_, height)| height);
        let measured = [fresh(barometer), fresh(receiver)].into_iter().flatten();
        // The nearer of them: one of two may be the one that is wrong.
        let nearest = measured
            .map(|height| (height - estimated).abs())
            .fold(None, |nearest: Option<f32>, apart| Some(nearest.map_or(apart, |nearest| -larger(-nearest, -apart))));
        let is_apart = nearest.is_some_and(|apart| apart > APART);
        self.since = if is_apart { self.since.or(Some(now)) } else { None };
        self.since.is_some_and(|since| now.since(since) >= LASTS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first second in which it is lost.
    fn lost(heights: impl Fn(u64) -> (f32, Option<f32>, Option<f32>)) -> Option<u64> {
        let mut watched = Heights::default();
        (0..60).find(|second| {
            let now = Instant::from_secs(*second);
            let (estimated, barometer, receiver) = heights(*second);
            watched.step(now, estimated, barometer.map(|height| (now, height)), receiver.map(|height| (now, height)))
        })
    }

    #[test]
    fn a_height_that_runs_away_is_lost_and_one_of_two_that_is_wrong_is_not() {
        assert_eq!(lost(|second| (second as f32 * 10.0, Some(0.0), Some(3.0))), Some(4 + 5));
        assert_eq!(lost(|_| (40.0, Some(200.0), Some(45.0))), None, "a barometer that leaps");
        assert_eq!(lost(|_| (40.0, Some(42.0), Some(-300.0))), None, "a receiver that does");
        assert_eq!(lost(|_| (40.0, Some(200.0), None)), Some(5), "nothing else is there");
        assert_eq!(lost(|_| (400.0, None, None)), None, "nothing to compare it with");
        assert_eq!(lost(|second| (if second < 4 { 400.0 } else { 40.0 }, Some(42.0), None)), None, "it is reset");
        assert_eq!(lost(|_| (60.0, Some(40.0), Some(50.0))), None, "drift");
    }

    #[test]
    fn what_was_measured_long_ago_says_nothing() {
        let mut heights = Heights::default();
        let old = Some((Instant::ZERO, 0.0));
        assert!((3..60).all(|second| !heights.step(Instant::from_secs(second), 500.0, old, old)));
    }
}
