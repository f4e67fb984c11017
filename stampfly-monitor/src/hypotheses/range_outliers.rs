//! Many ranges jump, each for itself: outliers, or the edge of something below.

use crate::config::MonitorConfig;
use crate::evidence::Evidence;
use crate::hypothesis::{Hypothesis, Opinion, Sensor};
use stampfly_types::math;
use stampfly_types::messages::Finding;

/// Jumps, less one for every so many seconds.
const JUMPS: f32 = 5.0;
const FADES: f32 = 0.4;
/// More than so many times the estimate's height was moved to a range, until none was rejected for
/// three seconds.
const MOVES: u32 = 3;

/// See the head of this file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RangeOutliers {
    jumps: f32,
}

impl Hypothesis for RangeOutliers {
    const SENSOR: Sensor = Sensor::Range;
    const FINDING: Finding = Finding::Outliers;

    fn step(&mut self, _: &MonitorConfig, seen: &Evidence<'_>) -> Opinion {
        let Some(range) = seen.range.as_ref().filter(|_| !seen.stands) else { return Opinion::Unknown };
        self.jumps = math::larger(self.jumps - range.dt / FADES, 0.0) + f32::from(u8::from(range.jumps));
        if self.jumps > JUMPS || seen.altimeter.has_settled() && seen.moves > MOVES {
            Opinion::Holds(seen.back_to_altimeter())
        } else {
            Opinion::Unknown
        }
    }
}
