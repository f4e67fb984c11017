//! Many ranges jump independently: outliers, or the edge of an object below.

use crate::config::MonitorConfig;
use crate::evidence::Evidence;
use crate::hypothesis::{Hypothesis, Opinion, Sensor};
use stampfly_types::math;
use stampfly_types::messages::Finding;

/// Limit of the jump counter, which decreases by one per `FADES` seconds.
const JUMPS: f32 = 5.0;
const FADES: f32 = 0.4;
/// Largest number of resets of the estimate's height to the range within a series of rejections;
/// the series ends after three seconds without one.
const MOVES: u32 = 3;

/// Tests whether many ranges jump independently. Details are at the head of the file.
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
