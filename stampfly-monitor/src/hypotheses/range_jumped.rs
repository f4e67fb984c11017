//! The range jumps and stays there while the vehicle does not move sideways.
//!
//! A table also makes a range jump, but only under a vehicle that crosses its edge. A wrapped phase
//! reads less than half of the distance; over a table of that height the barometer holds the
//! height, and the range is used again behind it.
//!
//! This hypothesis also clears the range: after a second of readings that change, do not jump and
//! agree with the estimate.

use crate::config::MonitorConfig;
use crate::evidence::Evidence;
use crate::hypothesis::{Hypothesis, Opinion, Sensor};
use stampfly_types::math;
use stampfly_types::messages::{Finding, SensorMask};

/// Speed at which a vehicle may cross an edge, m/s.
const CROSSES: f32 = 0.15;
/// Share of the expected distance below which a sudden reading is no real surface.
const NEARER: f32 = 0.5;
/// Number of consecutive rejections: 0.13 s, before the estimator resets its height to them.
const REJECTED: u32 = 4;
/// Largest difference from the expected range for agreement, m.
const AGREES: f32 = 0.15;
/// Number of repetitions from which a reading does not count as agreement.
const REPEATED: u32 = 15;

/// Tests whether the range jumps and stays there without an edge below; also clears the range.
/// Details are at the head of the file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RangeJumped {
    /// Number of consecutive rejections, and whether the first of them jumped or leaped.
    rejected: u32,
    jumped: bool,
    leaped: bool,
}

impl Hypothesis for RangeJumped {
    const SENSOR: Sensor = Sensor::Range;
    const FINDING: Finding = Finding::Jumped;

    fn step(&mut self, _: &MonitorConfig, seen: &Evidence<'_>) -> Opinion {
        let Some(range) = seen.range.as_ref().filter(|_| !seen.stands) else { return Opinion::Unknown };
        // Left out: test for agreement only, which clears the finding.
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
        // An estimator that started in the air must find its height first.
        let wrong = seen.altimeter.has_begun() && (nearer || self.jumped && stays);
        if wrong && self.rejected >= REJECTED { Opinion::Holds(None) } else { Opinion::Unknown }
    }
}
