//! The range jumps and stays there, and the vehicle does not move sideways.
//!
//! A table makes a range jump, too, but only below a vehicle that crosses its edge. And a phase that
//! wraps reads less than half of the distance; over a table as high as that the barometer holds the
//! height, and behind it the range is used again.
//!
//! Here the range is cleared, too: a second of readings that change, do not jump and lie where the
//! estimate expects them.

use crate::config::MonitorConfig;
use crate::evidence::Evidence;
use crate::hypothesis::{Hypothesis, Opinion, Sensor};
use stampfly_types::math;
use stampfly_types::messages::{Finding, SensorMask};

/// At this speed a vehicle may cross an edge or a table meanwhile, m/s.
const CROSSES: f32 = 0.15;
/// Nor does it see something rise to less than this share of the distance.
const NEARER: f32 = 0.5;
/// Readings running that the estimator rejects: 0.13 s, before it moves its height to them.
const REJECTED: u32 = 4;
/// How near a range has to be to what is expected, m, to be used again.
const AGREES: f32 = 0.15;
/// A reading that repeats itself so often agrees with nothing.
const REPEATED: u32 = 15;

/// See the head of this file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RangeJumped {
    /// Readings running that were rejected, and whether the first of them jumped or leaped.
    rejected: u32,
    jumped: bool,
    leaped: bool,
}

impl Hypothesis for RangeJumped {
    const SENSOR: Sensor = Sensor::Range;
    const FINDING: Finding = Finding::Jumped;

    fn step(&mut self, _: &MonitorConfig, seen: &Evidence<'_>) -> Opinion {
        let Some(range) = seen.range.as_ref().filter(|_| !seen.stands) else { return Opinion::Unknown };
        if !seen.trusts_range {
            let agrees = (range.distance - range.expected).abs() < AGREES
                && !range.jumps
                && seen.range_repeat.is_some_and(|repeat| repeat.count < REPEATED);
            return if agrees { Opinion::Fits } else { Opinion::Misfits };
        }
        if !range.rejected {
            *self = Self { rejected: 0, jumped: range.jumps, leaped: range.leaps };
            return Opinion::Unknown;
        }
        self.rejected = self.rejected.saturating_add(1);
        if self.rejected == 1 {
            (self.jumped, self.leaped) = (range.jumps, range.leaps);
        }
        let velocity = seen.estimate.velocity;
        let speed = math::sqrt(velocity.x * velocity.x + velocity.y * velocity.y);
        let stays = seen.estimate.sensors.contains(SensorMask::FLOW) && speed < CROSSES;
        let nearer = range.distance < NEARER * range.expected && (self.jumped || self.leaped);
        // An estimator that started in the air has to find its height first.
        let wrong = seen.altimeter.has_begun() && (nearer || self.jumped && stays);
        if wrong && self.rejected >= REJECTED { Opinion::Holds(None) } else { Opinion::Unknown }
    }
}
