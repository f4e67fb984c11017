//! What a hypothesis is: one thing that may be wrong with one sensor, and what it says about a step.

use crate::config::MonitorConfig;
use crate::evidence::Evidence;
use stampfly_types::messages::{EstimateCorrection, Finding};

/// A sensor that is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensor {
    /// Gyro.
    Gyro,
    /// Range to the ground.
    Range,
    /// Optical flow.
    Flow,
}

/// What a hypothesis says about a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Opinion {
    /// There is nothing to judge by.
    Unknown,
    /// What is seen fits a sound sensor.
    Fits,
    /// It fits badly, which is not enough to say that it is wrong.
    Misfits,
    /// The hypothesis holds, with what puts the estimate right if the sensor has misled it.
    Holds(Option<EstimateCorrection>),
}

/// One thing that may be wrong with one sensor.
///
/// It remembers what it needs, and sees each step once, in order. The monitor
/// acts on the step in which it begins to hold; on a [`Finding::Shifted`] in each.
pub trait Hypothesis {
    /// The sensor.
    const SENSOR: Sensor;
    /// What is wrong with it, if the hypothesis holds.
    const FINDING: Finding;

    /// Takes a step.
    fn step(&mut self, config: &MonitorConfig, seen: &Evidence<'_>) -> Opinion;
}
