//! The height that the ranges make is not the one that barometer and accelerometer make.
//!
//! The paths of both are compared over some seconds, and fade. Where barometer and accelerometer do
//! not agree, the pressure has changed, and the comparison begins anew.
//!
//! Not for a range that is off by a constant, which is a table.

use crate::config::MonitorConfig;
use crate::evidence::Evidence;
use crate::hypothesis::{Hypothesis, Opinion, Sensor};
use stampfly_types::Instant;
use stampfly_types::messages::Finding;

/// Difference of the paths, which fades with a time constant, m and s. A slope of 20° at 0.5 m/s makes
/// 0.7.
const HEIGHT: f32 = 0.8;
const FADING: f32 = 4.0;
/// For so long, s: until then the barometer's disagreement with the accelerometer would have shown.
const LASTS: f32 = 0.5;
/// Below this height the pressure under the propellers changes with it, m.
const NEAR: f32 = 0.35;

/// See the head of this file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RangeDrifts {
    /// The estimate's path less the barometer's, m.
    path: f32,
    since: Option<Instant>,
}

impl Hypothesis for RangeDrifts {
    const SENSOR: Sensor = Sensor::Range;
    const FINDING: Finding = Finding::Disagrees;

    fn step(&mut self, _: &MonitorConfig, seen: &Evidence<'_>) -> Opinion {
        // What the estimate does while it rejects ranges is not what they say.
        let says = seen.trusts_range && !seen.range_is_silent && seen.altimeter.has_settled();
        if seen.stands || !says || seen.estimate.height < NEAR {
            *self = Self::default();
            return Opinion::Unknown;
        }
        if let Some(block) = &seen.block
            && !seen.range_is_rejected
        {
            self.path += (-seen.estimate.velocity.z - self.path * (1.0 / FADING)) * block.dt;
        }
        if let Some(altitude) = &seen.altitude {
            if altitude.stepped || altitude.stuck {
                *self = Self::default();
            } else if !seen.range_is_rejected {
                self.path -= altitude.change;
            }
        }
        if self.path.abs() < HEIGHT {
            self.since = None;
            return Opinion::Unknown;
        }
        let since = *self.since.get_or_insert(seen.now);
        if seen.now.since(since).seconds() < LASTS {
            return Opinion::Unknown;
        }
        let higher = -self.path - seen.moved;
        *self = Self::default();
        // Which of the two it is, ranges or pressure, nothing else shows.
        Opinion::Holds(seen.back_to_altimeter(Some(higher)))
    }
}
