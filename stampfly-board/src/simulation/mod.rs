//! The StampFly in simulation: its world, its drivers, who asks it for something, and how well it did.
//!
//! | module | what it is |
//! |---|---|
//! | [`plant`] | the vehicle as a body |
//! | [`sensing`] | what feeds the bus: models of the sensors, or the drivers over emulated chips |
//! | [`mission`], [`ground_station`] | what to fly, and the program that asks the vehicle for it |
//! | [`pilot`], [`radio`] | a person with a transmitter instead; what carries commands and telemetry |
//! | [`Settings`] | the vehicle's parameters while it is on |
//! | [`Air`] | the secure session as real bytes on that radio, and a flood of a stranger's |
//! | [`faults`], [`judge`] | what can go wrong, and what came of it |
//! | [`bench`](mod@bench) | a vehicle on a bench, with somebody who holds it, looks, listens and presses its button |
//! | [`metrics`] | how good a flight was |
//! | [`flight`] | one flight: what is started, what is watched |
//! | `live`, `terminal` | its ports and services when other programs fly it; a command line |
//! | [`Setup`], [`Outcome`] | what decides a flight, and how it went |
//!
//! For programs on a PC (feature `simulation`); nothing of it is in the firmware.

mod air;
pub mod bench;
pub mod faults;
pub mod flight;
pub mod ground_station;
mod home;
pub mod judge;
mod live;
pub mod metrics;
pub mod mission;
mod outcome;
mod page;
pub mod pilot;
pub mod plant;
pub mod radio;
pub mod sensing;
mod settings;
mod setup;
mod terminal;
mod watch;

pub use air::{Air, AirReport};
pub use outcome::{Outcome, PhaseChange};
pub use page::PAGE;
pub use plant::PLANT;
pub use settings::Settings;
pub use setup::Setup;

use crate::config::VehicleConfig;
use crate::golden;
use crate::schedule::Runnables;
use crate::topics::Id;
use mission::Mission;
use sensing::Sensing;
use stampfly_log::ulog::{ParameterValue, Topic};
use stampfly_sim::Truth;
use stampfly_sim::fault::{FaultKind, Moment};
use stampfly_sim::sticks::{StickOptions, Sticks, Throttle, mode_named};
use stampfly_sim::vehicle::{
    self, Ended, FlightOptions, Golden, Options, Page, PortSpec, Remote, RemoteError, Setting, SetupError, Variety,
    Vehicle, Witness,
};
use stampfly_types::Message;
use std::format;
use std::string::{String, ToString};
use std::vec::Vec;

/// The StampFly, for programs that fly vehicles.
#[derive(Clone, Copy, Debug)]
pub struct StampFly;

impl Vehicle for StampFly {
    const NAME: &'static str = "stampfly";
    const BESIDE: &'static [Topic] = &[Topic { name: "truth", fields: Truth::FIELDS }];
    const FAULTS: &'static [FaultKind] = faults::FAULTS;
    const VARIETY: Variety = Variety {
        modes: pilot::MODES,
        missions: &[mission::SHORT, "square", "random"],
        occasions: mission::OCCASIONS,
        times: [3, 12],
        chips: true,
    };
    const PORTS: &'static [PortSpec] = live::PORTS;
    const PAGE: Page = PAGE;
    type Runnables = Runnables;
    type Setup = Setup;
    type Outcome = Outcome;

    fn setup(options: &Options, seed: u64) -> Result<Setup, SetupError> {
        let mut setup = Setup::reference(seed);
        setup.mission = mission_of(options, seed)?;
        if let Some(live) = &options.live {
            if options.mission.is_some() || options.pilot.is_some() {
                return Err("other programs fly it: it has neither a mission nor a pilot".into());
            }
            setup = setup.flown_by(live.clone());
        }
        options.change(&mut setup.simulation)?;
        vehicle::table::change(&mut setup.vehicle, options)?;
        if let Some(typed) = &options.sticks {
            let sticks = sticks_of(typed, options, &setup)?;
            setup = setup.playing(sticks);
        }
        setup.faults = options.faults(faults::FAULTS)?;
        if let Some(name) = &options.pilot {
            let mode = pilot::mode_named(name);
            let unknown = || format!("--mode '{name}' is none of {}", pilot::MODES.join(", "));
            setup.pilot = Some(mode.ok_or_else(unknown)?);
        }
        setup.vehicle.flies_on = options.flies_on;
        setup.sensing = if options.chips { Sensing::Chips } else { Sensing::Models };
        setup.cameras = options.cameras;
        setup.jitter = options.jitter;
        Ok(setup)
    }

    fn settled(options: &Options, seed: u64) -> Result<Options, SetupError> {
        if let Some(sticks) = &options.sticks {
            return Ok(Options { sticks: Some(sticks.settled()?), ..options.clone() });
        }
        // The semicolon at the end says that it is a mission's text, and not a file.
        let mission = format!("{};", mission_of(options, seed)?);
        Ok(Options { mission: Some(mission), ..options.clone() })
    }

    fn again(setup: &Setup, outcome: &Outcome) -> Option<Setup> {
        let kept = outcome.restart.as_ref()?;
        Some(Setup { vehicle: kept.as_ref().unwrap_or(&setup.vehicle).clone(), ..setup.clone() })
    }

    fn options(setup: &Setup) -> FlightOptions {
        FlightOptions { start: setup.simulation.start, limit: setup.limit, jitter: setup.jitter }
    }

    fn config(setup: &Setup) -> &VehicleConfig {
        &setup.vehicle
    }

    fn fly(
        setup: &Setup,
        witness: &mut dyn Witness<Runnables>,
        report: &mut dyn FnMut(f32, &'static str),
    ) -> Ended<Outcome> {
        let mut surroundings = flight::Surroundings::new(setup);
        vehicle::fly(&setup.vehicle, &Self::options(setup), &mut surroundings, witness, report)
    }

    fn fly_remote(
        setup: &Setup,
        remote: &mut Remote<'_>,
        witness: &mut dyn Witness<Runnables>,
        report: &mut dyn FnMut(f32, &'static str),
    ) -> Result<Ended<Outcome>, RemoteError> {
        let mut surroundings = flight::Surroundings::new(setup);
        vehicle::fly_remote(&setup.vehicle, &Self::options(setup), &mut surroundings, remote, witness, report)
    }

    fn default_config() -> VehicleConfig {
        VehicleConfig::default()
    }

    fn parameters(config: &VehicleConfig) -> Vec<Setting> {
        // No parameter, but what a log needs to be replayed.
        let meaning = "1: flies on where a protection stops the motors in the air";
        let flies_on = Setting { name: FLIES_ON, value: 1.0, unit: "1", meaning };
        vehicle::table::settings(config).into_iter().chain(config.flies_on.then_some(flies_on)).collect()
    }

    fn set_parameter(config: &mut VehicleConfig, name: &str, value: ParameterValue) -> Result<(), SetupError> {
        match value {
            ParameterValue::Float(value) if name == FLIES_ON => {
                config.flies_on = value != 0.0;
                Ok(())
            }
            value => vehicle::table::set(config, name, value),
        }
    }

    fn parameter_range(name: &str) -> Option<[f64; 2]> {
        vehicle::table::range::<VehicleConfig>(name)
    }

    fn has_same_components(one: &VehicleConfig, other: &VehicleConfig) -> bool {
        one.estimator == other.estimator
    }

    fn golden() -> Option<Golden<Self>> {
        Some(Golden {
            setup: Setup { mission: Mission::parse(GOLDEN).ok()?, ..Setup::reference(1) },
            record: golden::FLIGHT,
            output: golden::OUTPUT as usize,
            tolerance: golden::TOLERANCE,
            leading: Id::sensor_imu as usize,
            settled: |outcome| outcome.phases.last().map(|phase| phase.since),
        })
    }

    fn moments(options: &Options, seed: u64) -> Vec<Moment> {
        let Some(mission) = mission_of(options, seed).ok().filter(|_| options.sticks.is_none()) else {
            return Moment::USUAL.to_vec();
        };
        mission.moments(options.pilot.as_deref().and_then(pilot::mode_named))
    }

    fn shorter_missions(options: &Options, seed: u64) -> Vec<String> {
        if options.sticks.is_some() {
            return Vec::new();
        }
        let Ok(Mission { steps }) = mission_of(options, seed) else { return Vec::new() };
        let [arm, takeoff, middle @ .., land] = steps.as_slice() else { return Vec::new() };
        let shorter = |count| {
            let middle = middle.iter().take(count);
            Mission { steps: [arm, takeoff].into_iter().chain(middle).chain([land]).copied().collect() }.to_string()
        };
        (0..middle.len()).map(shorter).collect()
    }

    fn plant(setup: &Setup) -> Vec<Setting> {
        vehicle::table::simulation(&setup.simulation)
    }
}

/// The stick file that is typed, for a vehicle that is set up like this.
fn sticks_of(typed: &StickOptions, options: &Options, setup: &Setup) -> Result<Sticks, SetupError> {
    if options.mission.is_some() || options.pilot.is_some() || options.live.is_some() {
        return Err("--sticks says what is flown: there is neither a mission, nor a pilot, nor another program".into());
    }
    let mode = typed.mode.as_deref().map(|name| {
        let unknown = || format!("--mode '{name}' is none of {}", pilot::MODES.join(", "));
        mode_named(name).ok_or_else(unknown)
    });
    let VehicleConfig { authority, cascade, .. } = &setup.vehicle;
    let altitude = &cascade.altitude;
    // The dead band is no thrust, and what is beyond it is spread over the rest.
    let rest = authority.dead_band;
    let hover = rest + (1.0 - rest) * altitude.hover_thrust / altitude.thrust_max;
    Sticks::new(typed, mode.transpose()?, Throttle { rest, hover, of_file: None })
}

/// The mission that options name: one that is built in, the text of one, or a file.
fn mission_of(options: &Options, seed: u64) -> Result<Mission, SetupError> {
    let name = options.mission.as_deref().unwrap_or("square");
    match name {
        "square" => Mission::parse(mission::REFERENCE),
        "hover" => Mission::parse(mission::HOVER),
        "random" => Ok(Mission::random(seed)),
        text if text.contains(';') => Mission::parse(text),
        path => {
            let text = std::fs::read_to_string(path).map_err(|error| format!("mission {path}: {error}"))?;
            Mission::parse(&text)
        }
    }
    .map_err(|error| format!("mission {name}: {error}"))
}

/// Under this name a log has that protections did not stop the motors in the air.
const FLIES_ON: &str = "simulation.flies_on";

/// The mission of the golden flight.
const GOLDEN: &str = "arm\ntakeoff 0.2\nhover 0.3\nland\n";
