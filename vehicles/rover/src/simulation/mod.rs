//! The rover for programs that fly vehicles: `stampfly fly`, `campaign`, `replay` and `serve` with `--vehicle rover`.
//!
//! A seed decides by how much the vehicle differs from its data sheet and how exactly the operator hits the pedals; seed 0 is
//! exact. The dynamics are one of the vehicle's own components, so there is no world around it.

mod drive;
mod link;
mod page;

pub use drive::{Drive, Driver, Setup};

use crate::{Parameters, Runnables, schedule::TICK};
use stampfly_log::ulog::ParameterValue;
use stampfly_param::ParameterTable;
use stampfly_sim::Noise;
use stampfly_sim::vehicle::{
    self, Ended, FlightOptions, Options, Page, PortSpec, Script, Scripted, Setting, SetupError, Vehicle, Witness,
    WorldKind, table,
};
use stampfly_types::{Duration, Instant};
use std::prelude::v1::*;

/// The rover, for programs that fly vehicles.
#[derive(Clone, Copy, Debug)]
pub struct Rover;

/// What differs from one vehicle to the next, and by which share at most.
const VARIED: [&str; 4] = ["engine.max_accel", "brake.max_decel", "steering.time_constant", "vehicle.wheelbase"];
const SHARE: f64 = 0.1;
/// Random number stream of the vehicle.
const STREAM: u64 = 1_100;

impl Vehicle for Rover {
    const NAME: &'static str = "rover";
    const PORTS: &'static [PortSpec] = &[PortSpec::udp("listen", 47_003, "commands and the log")];
    const PAGE: Page = page::PAGE;
    type Runnables = Runnables;
    type Setup = Setup;
    type Outcome = Drive;

    fn setup(options: &Options, seed: u64) -> Result<Setup, SetupError> {
        let Options { mission, plant, world, vibration, gust, wind, chips, cameras, jitter, live, pilot, .. } = options;
        options.faults(Self::FAULTS)?;
        if pilot.is_some() {
            return Err("the rover has no pilot: its missions say who drives".into());
        }
        if options.sticks.is_some() {
            return Err("the rover has no sticks: its missions say who drives, and how".into());
        }
        if options.flies_on {
            return Err("--fly-on: a rover does not fly".into());
        }
        if !plant.is_empty()
            || *world != WorldKind::Gentle
            || vibration.is_some()
            || gust.is_some()
            || wind.is_some()
            || *chips
            || *cameras
        {
            return Err("the rover has no plant, harsh world, vibration, wind, chips or cameras".into());
        }
        let mut parameters = Parameters::default();
        let mut noise = Noise::new(seed, STREAM);
        for name in VARIED.into_iter().filter(|_| seed != 0) {
            let row = Parameters::find(name).map_err(|error| error.to_string())?;
            let value = row.get(&parameters) * (1.0 + noise.within(SHARE)) as f32;
            Self::set_parameter(&mut parameters, name, value.into())?;
        }
        table::change(&mut parameters, options)?;
        let driver = match live {
            Some(live) => Driver::Live(live.clone()),
            None => Driver::named(mission.as_deref().unwrap_or("course"))?,
        };
        Ok(Setup { parameters, driver, seed, jitter: *jitter })
    }

    fn options(setup: &Setup) -> FlightOptions {
        // The drive itself says when it is over; an executor may be late.
        let limit = Duration::from_micros(TICK.as_micros() * (setup.length() as u64 + 1));
        FlightOptions { start: Instant::ZERO, limit, jitter: setup.jitter }
    }

    fn config(setup: &Setup) -> &Parameters {
        &setup.parameters
    }

    fn fly(
        setup: &Setup,
        witness: &mut dyn Witness<Runnables>,
        report: &mut dyn FnMut(f32, &'static str),
    ) -> Ended<Drive> {
        vehicle::fly(&setup.parameters, &Self::options(setup), &mut Scripted::new(setup), witness, report)
    }

    fn default_config() -> Parameters {
        Parameters::default()
    }

    fn parameters(config: &Parameters) -> Vec<Setting> {
        table::settings(config)
    }

    fn set_parameter(config: &mut Parameters, name: &str, value: ParameterValue) -> Result<(), SetupError> {
        table::set(config, name, value)
    }
}
