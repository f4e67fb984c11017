//! Flow velocity deviates from dead reckoning.
//!
//! The residual against a reckoner exceeds the gate, and a shift of the gyro's zero is not the
//! better explanation ([`course`](crate::course)). Detects reversed, swapped or dead axes, and an
//! offset present since the take-off.
//!
//! Not for scale errors within the spread of cameras, nor for an offset that began before the
//! reckoner: no other sensor measures a constant velocity.

use crate::config::MonitorConfig;
use crate::course::Explanation;
use crate::evidence::Evidence;
use crate::hypothesis::{Hypothesis, Opinion, Sensor};
use stampfly_types::messages::Finding;

/// Time after which an unexplained course counts as a camera fault, s. Within it, a shift of the
/// gyro's zero that has just begun has developed its own course.
const UNCLEAR: f32 = 0.3;
/// The same where a shift and another cause explain the course similarly well, because their
/// courses diverge later; and where it would be a second shift within seconds.
const PERHAPS_GYRO: f32 = 0.8;

/// Tests whether flow velocity deviates from dead reckoning, and a gyro shift does not explain it.
/// Details are at the head of the file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FlowDisagrees {
    /// Time for which the residual has exceeded the gate, s.
    exceeds: f32,
    /// The fault was present when the vehicle last stood. Later agreement may be due to a constant
    /// offset, so the finding is kept until the vehicle stands again.
    since_stood: bool,
}

impl Hypothesis for FlowDisagrees {
    const SENSOR: Sensor = Sensor::Flow;
    const FINDING: Finding = Finding::Disagrees;

    fn step(&mut self, config: &MonitorConfig, seen: &Evidence<'_>) -> Opinion {
        if seen.stands {
            *self = Self::default();
        }
        let Some(flow) = seen.flow.as_ref().filter(|_| !seen.stands) else { return Opinion::Unknown };
        if self.since_stood {
            return Opinion::Holds(None);
        }
        if !flow.comparable || !seen.settled {
            self.exceeds = 0.0;
            return Opinion::Unknown;
        }
        self.exceeds = if flow.ratio > 1.0 { self.exceeds + flow.interval } else { 0.0 };
        let course = seen.course(seen.reckoners.older());
        if self.exceeds < config.lasts_s {
            return match course.agrees(config.flow_motion_m_s) {
                None => Opinion::Unknown,
                Some(true) => Opinion::Fits,
                Some(false) => Opinion::Misfits,
            };
        }
        match course.explanation(&seen.limits(config, seen.reckoners.older(), flow.distance)) {
            Explanation::Tilt => Opinion::Misfits,
            Explanation::Gyro(_) if !seen.shifted_lately || self.exceeds < PERHAPS_GYRO => Opinion::Misfits,
            Explanation::Unclear if self.exceeds < UNCLEAR => Opinion::Misfits,
            Explanation::PerhapsGyro if self.exceeds < PERHAPS_GYRO => Opinion::Misfits,
            Explanation::Unclear | Explanation::PerhapsGyro | Explanation::Gyro(_) | Explanation::Camera => {
                self.since_stood = seen.reckoners.get(seen.reckoners.older()).stood;
                Opinion::Holds(Some(seen.back_to_reckoned()))
            }
        }
    }
}
