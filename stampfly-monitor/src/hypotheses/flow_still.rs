//! The camera shows no motion at all while the body turns.
//!
//! It is covered, or has no features without reporting that. The image of a turning body can only
//! stand still if the vehicle moves by rotation times distance in the opposite direction, which one
//! carried by a person does by millimetres at most.

use crate::config::MonitorConfig;
use crate::evidence::Evidence;
use crate::hypothesis::{Hypothesis, Opinion, Sensor};
use stampfly_types::math;
use stampfly_types::messages::Finding;

/// Tests whether the camera shows no motion while the body turns. Details are at the head of the
/// file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FlowStill {
    /// Number of consecutive zero readings.
    zeros: u32,
    /// Rotation of the body since then, and its largest value, rad.
    turn: [f32; 2],
    turned: f32,
}

impl Hypothesis for FlowStill {
    const SENSOR: Sensor = Sensor::Flow;
    const FINDING: Finding = Finding::Blind;

    fn step(&mut self, config: &MonitorConfig, seen: &Evidence<'_>) -> Opinion {
        let Some(flow) = &seen.flow else { return Opinion::Unknown };
        if flow.counts != [0.0; 2] || flow.distance < config.flow_sharp_m || seen.stands {
            *self = Self::default();
            return Opinion::Unknown;
        }
        self.zeros = self.zeros.saturating_add(1);
        let bias = seen.estimate.gyro_bias;
        for (turn, rate) in self.turn.iter_mut().zip([flow.turning[0] - bias.y, flow.turning[1] + bias.x]) {
            *turn += rate * flow.interval;
            self.turned = math::larger(self.turned, turn.abs());
        }
        if self.zeros < config.flow_zeros {
            return Opinion::Unknown;
        }
        // Both: enough rotation for the camera to resolve, and more than the vehicle may move
        // unnoticed.
        if self.turned > config.flow_turn_rad && self.turned * flow.distance > config.flow_motion_m {
            Opinion::Holds(seen.back_to_before(self.zeros as f32 * flow.interval))
        } else {
            // Zero readings are no agreement with the motion.
            Opinion::Misfits
        }
    }
}
