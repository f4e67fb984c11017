//! The quadcopter for programs that fly vehicles: `stampfly fly`, `campaign`, `replay` and `serve` with `--vehicle stm32-quad`.
//!
//! | module | what it is |
//! |---|---|
//! | [`plant`] | the frame as a body |
//! | [`pilot`], [`stunts`] | who flies it with a transmitter, and what for |
//! | [`radio`] | the transmitter's frames through the air |
//! | [`serial`] | its ports, for other programs |
//! | [`faults`] | what can go wrong |
//! | [`Setup`], [`flight`], [`Outcome`] | what decides a flight, one flight, and how it went |

pub mod faults;
pub mod flight;
pub mod outcome;
mod page;
pub mod pilot;
pub mod plant;
pub mod radio;
pub mod serial;
mod setup;
pub mod stunts;

pub use outcome::{Measured, Outcome};
pub use setup::Setup;
use stunts::Stunt;

use crate::parameters::Parameters;
use crate::schedule::Runnables;
use stampfly_log::ulog::{ParameterValue, Topic};
use stampfly_sim::fault::FaultKind;
use stampfly_sim::sight::{Leg, Places};
use stampfly_sim::sticks::{StickOptions, Sticks};
use stampfly_sim::vehicle::{
    self, Ended, FlightOptions, Options, Page, PortSpec, Setting, SetupError, Variety, Vehicle, Witness, table,
};
use stampfly_sim::{SimulationConfig, Truth};
use stampfly_types::{Duration, Message, Vec3};
use std::prelude::v1::*;

/// The quadcopter, for programs that fly vehicles.
#[derive(Clone, Copy, Debug)]
pub struct Stm32Quad;

/// Strength of vibration, of what brushed motors of the StampFly do: brushless ones with balanced propellers shake less.
const VIBRATION: f64 = 0.3;
/// No flight is longer.
const LIMIT: Duration = Duration::from_secs(600);

/// Missions by name.
const MISSIONS: [(&str, &str); 2] =
    [("hover", "0,0,1.5,20"), ("square", "0,0,1.5,2; 3,0,1.5,2; 3,3,2,2; 0,3,1.5,2; 0,0,1.5,2")];
/// Those that are more than places.
const STUNTS: [(&str, &str, Stunt); 2] =
    [("freestyle", "0,0,40,1", Stunt::Freestyle(30.0)), ("drop", "0,0,1,2", Stunt::Drop(0.1))];

fn mission_of(text: &str) -> Result<(Places, Option<Stunt>), SetupError> {
    let stunt = STUNTS.iter().find(|(name, ..)| *name == text);
    let named = MISSIONS.iter().find(|(name, _)| *name == text).map(|(_, places)| *places);
    let places = stunt.map(|(_, places, _)| *places).or(named).unwrap_or(text);
    let places = places
        .parse()
        .map_err(|error| format!("--mission {text}: hover, square, freestyle, drop, or places: {error}"))?;
    Ok((places, stunt.map(|(.., stunt)| *stunt)))
}

/// Is the mode of this name ACRO? ANGLE is the one without a name.
fn is_acro(mode: &str) -> Result<bool, SetupError> {
    match mode {
        "" | "angle" => Ok(false),
        "acro" => Ok(true),
        other => Err(format!("--mode '{other}' is none of angle, acro")),
    }
}

impl Vehicle for Stm32Quad {
    const NAME: &'static str = "stm32-quad";
    const BESIDE: &'static [Topic] = &[Topic { name: "truth", fields: Truth::FIELDS }];
    const FAULTS: &'static [FaultKind] = faults::FAULTS;
    const VARIETY: Variety = Variety {
        modes: &["angle", "acro"],
        missions: &["square", "hover"],
        times: [3, 20],
        chips: true,
        ..Variety::NONE
    };
    const PORTS: &'static [PortSpec] = serial::PORTS;
    const ASKS: &'static [&'static str] = serial::ASKS;
    const PAGE: Page = page::PAGE;
    type Runnables = Runnables;
    type Setup = Setup;
    type Outcome = Outcome;

    fn setup(options: &Options, seed: u64) -> Result<Setup, SetupError> {
        let Options { mission, chips, cameras, jitter, live, pilot, .. } = options;
        if *cameras {
            return Err("this vehicle has no cameras".into());
        }
        if options.flies_on {
            return Err("--fly-on: this vehicle does not offer it".into());
        }
        let mut simulation = SimulationConfig { seed, vibration: VIBRATION, ..SimulationConfig::new(plant::PLANT) };
        options.change(&mut simulation)?;
        let mut parameters = plant::parameters();
        table::change(&mut parameters, options)?;
        let acro = is_acro(pilot.as_deref().unwrap_or_default())?;
        let sticks = options.sticks.as_ref().map(|typed| pilot::sticks_of(typed, options)).transpose()?;
        // In live hands it stands with its transmitter on, unless somebody is to fly it.
        let (mission, stunt) = match (mission.as_deref(), live) {
            (None, Some(_)) => Default::default(),
            _ if sticks.is_some() => (Places(vec![Leg { place: Vec3::zeros(), stay: 0.0 }]), None),
            (name, _) => mission_of(name.unwrap_or("hover"))?,
        };
        Ok(Setup {
            simulation,
            parameters,
            mission,
            sticks,
            acro,
            stunt,
            faults: options.faults(Self::FAULTS)?,
            jitter: *jitter,
            chips: *chips,
            live: live.clone(),
        })
    }

    fn settled(options: &Options, _seed: u64) -> Result<Options, SetupError> {
        let sticks = options.sticks.as_ref().map(StickOptions::settled).transpose()?;
        Ok(Options { sticks, ..options.clone() })
    }

    fn options(setup: &Setup) -> FlightOptions {
        let played = setup.sticks.as_ref().map_or(Duration::ZERO, Sticks::length);
        FlightOptions { start: setup.simulation.start, limit: LIMIT + played, jitter: setup.jitter }
    }

    fn config(setup: &Setup) -> &Parameters {
        &setup.parameters
    }

    fn fly(
        setup: &Setup,
        witness: &mut dyn Witness<Runnables>,
        report: &mut dyn FnMut(f32, &'static str),
    ) -> Ended<Outcome> {
        let mut surroundings = flight::Surroundings::new(setup);
        vehicle::fly(&setup.parameters, &Self::options(setup), &mut surroundings, witness, report)
    }

    fn default_config() -> Parameters {
        plant::parameters()
    }

    fn parameters(config: &Parameters) -> Vec<Setting> {
        table::settings(config)
    }

    fn set_parameter(config: &mut Parameters, name: &str, value: ParameterValue) -> Result<(), SetupError> {
        table::set(config, name, value)
    }

    fn parameter_range(name: &str) -> Option<[f64; 2]> {
        table::range::<Parameters>(name)
    }

    fn plant(setup: &Setup) -> Vec<Setting> {
        table::simulation(&setup.simulation)
    }
}
