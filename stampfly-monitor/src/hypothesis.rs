//! The interface of a hypothesis: one possible fault of one sensor, tested in every step.

use crate::config::MonitorConfig;
use crate::evidence::Evidence;
use stampfly_types::messages::{EstimateCorrection, Finding};

/// A monitored sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensor {
    /// Gyro.
    Gyro,
    /// Range to the ground.
    Range,
    /// Optical flow.
    Flow,
}

/// Result of a hypothesis for one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Opinion {
    /// No information.
    Unknown,
    /// The sensor's data are consistent with a healthy sensor.
    Fits,
    /// The data are inconsistent, but not enough to report a fault.
    Misfits,
    /// The fault is present. The correction removes its effect from the estimate, if it had one.
    Holds(Option<EstimateCorrection>),
}

/// One possible fault of one sensor.
///
/// A hypothesis keeps its own state and receives each step once, in order. The monitor acts on the
/// step in which the hypothesis begins to hold; for [`Finding::Shifted`] on each step in which it
/// holds.
pub trait Hypothesis {
    /// The sensor.
    const SENSOR: Sensor;
    /// The finding reported when the hypothesis holds.
    const FINDING: Finding;

    /// Processes one step.
    fn step(&mut self, config: &MonitorConfig, seen: &Evidence<'_>) -> Opinion;
}
