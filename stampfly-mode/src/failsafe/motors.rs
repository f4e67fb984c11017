//! A motor or a propeller that has become weak.
//!
//! Its thrust is missed on one corner, so the controller asks for torque about roll and pitch at once, and keeps asking. A gust or
//! a manoeuvre asks for as much for a moment, a shifted load about one axis. A vehicle on the ground says nothing: what holds it
//! looks the same.

use super::config::FailsafeConfig;
use super::input::FailsafeInput;
use crate::lasting::lasts;
use stampfly_types::messages::Validity;
use stampfly_types::{Instant, Vec3};

/// Weight of a step in the mean torque: a time constant of 50 ms at 400 Hz, two of a motor.
const WEIGHT: f32 = 0.05;
/// Below this a leg may still touch the ground, m.
const CLEAR: f32 = 0.08;

/// What is remembered of the torque that the controller asks for.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct MotorMonitor {
    mean: Vec3,
    uneven: Option<Instant>,
}

impl MotorMonitor {
    /// Is a motor weak?
    pub(super) fn step(
        &mut self,
        config: &FailsafeConfig,
        now: Instant,
        input: &FailsafeInput<'_>,
        flies: bool,
    ) -> bool {
        let estimate = input.estimate;
        let near = estimate.valid.contains(Validity::HEIGHT) && estimate.height < CLEAR;
        if !flies || near {
            *self = Self::default();
            return false;
        }
        self.mean += (*input.torque - self.mean) * WEIGHT;
        let uneven = self.mean.x.abs() > config.weak_motor.x && self.mean.y.abs() > config.weak_motor.y;
        lasts(&mut self.uneven, now, uneven, config.weak_motor_time)
    }
}
