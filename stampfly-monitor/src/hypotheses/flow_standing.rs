//! The camera shows motion while the vehicle stands.

use crate::config::MonitorConfig;
use crate::evidence::Evidence;
use crate::hypothesis::{Hypothesis, Opinion, Sensor};
use stampfly_types::messages::Finding;

/// Rate above which the vehicle counts as carried, rad/s.
const TURNS: f32 = 0.5;

/// Tests whether the camera shows motion while the vehicle stands. Details are at the head of the
/// file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FlowStanding {
    /// Mean image rate, rad/s.
    rate: [f32; 2],
}

impl Hypothesis for FlowStanding {
    const SENSOR: Sensor = Sensor::Flow;
    const FINDING: Finding = Finding::Disagrees;

    fn step(&mut self, config: &MonitorConfig, seen: &Evidence<'_>) -> Opinion {
        let Some(flow) = seen.flow.as_ref().filter(|_| seen.stands) else { return Opinion::Unknown };
        let [x, y] = flow.turning;
        if x * x + y * y > TURNS * TURNS {
            return Opinion::Unknown;
        }
        let share = flow.interval / (config.flow_standing_s + flow.interval);
        for (mean, rate) in self.rate.iter_mut().zip(flow.rate) {
            *mean += (rate - *mean) * share;
        }
        let [x, y] = self.rate;
        if x * x + y * y > config.flow_standing_rad_s * config.flow_standing_rad_s {
            Opinion::Holds(None)
        } else {
            Opinion::Fits
        }
    }
}
