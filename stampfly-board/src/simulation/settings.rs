//! The vehicle's parameters while it is on, for a simulated pilot, a program and a page: a change
//! is published as a topic, and the flight loop takes it as [`stampfly_flight::live`] says.

use crate::VehicleConfig;
use crate::messages::ParameterChange;
use crate::parameters;
use crate::topics::ConsoleEnds;
use stampfly_flight::live::Change;
use stampfly_param::parameters::set_alone;
use stampfly_param::{ChangeDetector, ParameterError, Parameters};
use stampfly_types::Instant;
use std::cell::RefCell;

/// A change that waits for the flight loop's next moment of rest.
pub(super) type Waiting = RefCell<Option<Change<VehicleConfig>>>;

/// Parameters of a mission's flight.
pub struct Settings<'b> {
    config: VehicleConfig,
    detector: ChangeDetector<VehicleConfig>,
    console: ConsoleEnds<'b>,
    waiting: &'b Waiting,
}

impl<'b> Settings<'b> {
    /// Of a vehicle that was assembled with this configuration. Changes are told at this console,
    /// and wait there.
    pub(super) fn new(config: &VehicleConfig, console: ConsoleEnds<'b>, waiting: &'b Waiting) -> Self {
        Self { config: config.clone(), detector: ChangeDetector::new(config.clone()), console, waiting }
    }

    /// Changes the parameter at this place of the table.
    ///
    /// # Errors
    /// When the vehicle does not take the value, or cannot fly with it and the others. Nothing has
    /// changed then.
    pub fn set(&mut self, now: Instant, index: usize, value: f32) -> Result<(), ParameterError> {
        let mut config = self.config.clone();
        set_alone(&mut config, index, value)?;
        config.check(Some(index))?;
        self.config = config;
        tell(now, &mut self.detector, &self.config, &mut self.console, self.waiting);
        Ok(())
    }
}

/// Tells what of a configuration is new, and lets it wait for the flight loop.
pub(super) fn tell(
    now: Instant,
    detector: &mut ChangeDetector<VehicleConfig>,
    config: &VehicleConfig,
    console: &mut ConsoleEnds<'_>,
    waiting: &Waiting,
) {
    let lines = |name: &str| parameters::holders(name).iter().map(|line| *line as usize);
    let change = Change::detect(detector, config, lines, &mut |index, value| {
        console.parameter_change.publish(now, &ParameterChange { index: index as u32, value });
    });
    if let Some(change) = change {
        let earlier = waiting.take();
        waiting.replace(Some(match &earlier {
            Some(earlier) => change.after(earlier),
            None => change,
        }));
    }
}
