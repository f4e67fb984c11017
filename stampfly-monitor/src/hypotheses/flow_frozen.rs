//! The camera repeats one reading that is not zero: its registers can be read, but it has stopped
//! measuring.

use crate::config::MonitorConfig;
use crate::evidence::Evidence;
use crate::hypothesis::{Hypothesis, Opinion, Sensor};
use stampfly_types::messages::Finding;

/// Tests whether the camera repeats one reading that is not zero. Details are at the head of the
/// file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FlowFrozen {
    reading: [f32; 2],
    repeats: u32,
}

impl Hypothesis for FlowFrozen {
    const SENSOR: Sensor = Sensor::Flow;
    const FINDING: Finding = Finding::Stuck;

    fn step(&mut self, config: &MonitorConfig, seen: &Evidence<'_>) -> Opinion {
        let Some(flow) = &seen.flow else { return Opinion::Unknown };
        let repeats = flow.counts == self.reading && flow.counts != [0.0; 2];
        self.repeats = if repeats { self.repeats.saturating_add(1) } else { 0 };
        self.reading = flow.counts;
        // On the ground there is no motion, and flow is not used.
        if self.repeats >= config.flow_repeats && !seen.stands {
            Opinion::Holds(seen.back_to_before(self.repeats.saturating_add(1) as f32 * flow.interval))
        } else {
            Opinion::Unknown
        }
    }
}
