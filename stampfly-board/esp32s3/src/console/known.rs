//! What the vehicle knows of itself, as its console shows it.

use crate::facts::Facts;
use crate::memory::Memory;
use crate::sensors::Healths;
use core::cell::RefCell;
use core::fmt::Display;
use heapless::String;
use stampfly_board::VehicleConfig;
use stampfly_board::console::{self, Profile};
use stampfly_flight::console::SensorLine;

/// What the vehicle knows of itself.
pub(super) struct Known {
    pub(super) memory: &'static RefCell<Memory>,
    pub(super) health: &'static Healths,
    pub(super) profile: &'static Profile,
    /// Which firmware this is, and how its self test went.
    pub(super) version: String<128>,
    pub(super) facts: Facts,
}

impl Known {
    /// The vehicle as a console sees it now, with this configuration of the next start.
    pub(super) fn vehicle<R>(&self, config: &mut VehicleConfig, ask: impl FnOnce(&mut console::Console<'_>) -> R) -> R {
        let sensors = self.health.all();
        let errors = sensors.map(|(_, health)| health.last_error());
        let lines: [SensorLine<'_>; 7] = core::array::from_fn(|index| {
            let (name, health) = sensors[index];
            let last_error = errors[index].as_ref().map(|error| error as &dyn Display);
            SensorLine { name, samples: health.samples(), errors: health.errors(), last_error }
        });
        let mut memory = self.memory.borrow_mut();
        memory.catch_up();
        ask(&mut console::Console {
            version: &self.version,
            newest: &memory.newest,
            sensors: &lines,
            profile: self.profile,
            facts: &self.facts.all(),
            config,
        })
    }
}
