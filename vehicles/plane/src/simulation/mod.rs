//! The aircraft for programs that fly vehicles: `stampfly fly`, `campaign`, `replay` and `serve` with `--vehicle plane`.
//!
//! | module | what it is |
//! |---|---|
//! | [`plant`] | the aircraft as a body, and the field |
//! | [`mission`] | missions by name |
//! | [`faults`] | what can go wrong |
//! | [`services`] | what programs find at its ports |
//! | [`Setup`], [`flight`], [`Outcome`] | what decides a flight, one flight, and how it went |

pub mod faults;
pub mod flight;
pub mod mission;
pub mod outcome;
mod page;
pub mod plant;
pub mod services;
mod setup;

pub use outcome::Outcome;
pub use setup::Setup;

use crate::parameters::Parameters;
use crate::schedule::Runnables;
use stampfly_log::ulog::{ParameterValue, Topic};
use stampfly_sim::fault::FaultKind;
use stampfly_sim::plant::WindConfig;
use stampfly_sim::station::Mission;
use stampfly_sim::vehicle::{
    self, Ended, FlightOptions, Options, Page, PortSpec, Setting, SetupError, Variety, Vehicle, Witness, table,
};
use stampfly_sim::{SimulationConfig, Truth};
use stampfly_types::{Duration, Message};
use std::prelude::v1::*;

/// The aircraft, for programs that fly vehicles.
#[derive(Clone, Copy, Debug)]
pub struct Plane;

/// Strength of vibration, of what the motors of the StampFly do.
const VIBRATION: f64 = 0.5;
/// No flight is longer.
const LIMIT: Duration = Duration::from_secs(1_800);

impl Vehicle for Plane {
    const NAME: &'static str = "plane";
    const BESIDE: &'static [Topic] = &[Topic { name: "truth", fields: Truth::FIELDS }];
    const FAULTS: &'static [FaultKind] = faults::FAULTS;
    const VARIETY: Variety = Variety { missions: &["hop", "round", "twice"], times: [3, 120], ..Variety::NONE };
    const PORTS: &'static [PortSpec] = services::PORTS;
    const PAGE: Page = page::PAGE;
    type Runnables = Runnables;
    type Setup = Setup;
    type Outcome = Outcome;

    fn setup(options: &Options, seed: u64) -> Result<Setup, SetupError> {
        let Options { mission: text, chips, cameras, jitter, live, pilot, .. } = options;
        if *cameras || *chips || pilot.is_some() {
            return Err("this vehicle has no cameras, no emulated chips and no pilot".into());
        }
        if options.sticks.is_some() {
            return Err("this vehicle has no sticks: it flies missions".into());
        }
        if options.flies_on {
            return Err("--fly-on: this vehicle does not offer it".into());
        }
        let wind = WindConfig { gust: 0.3, ..WindConfig::MEADOW };
        let new = SimulationConfig::new(plant::PLANT);
        let mut simulation = SimulationConfig { seed, vibration: VIBRATION, wind, ..new };
        options.change(&mut simulation)?;
        // Whoever puts it there looks where the wind comes from.
        let towards = simulation.wind.mean;
        let (sin, cos) = plant::STRIP.sin_cos();
        let behind = f64::from(towards.x) * cos + f64::from(towards.y) * sin;
        let heading = if behind > 0.0 { plant::STRIP + core::f64::consts::PI } else { plant::STRIP };
        simulation.pose = Some(simulation.plant.standing([0.0; 2], heading));
        let mut parameters = plant::parameters();
        plant::calibrate(&mut parameters, &simulation);
        table::change(&mut parameters, options)?;
        let mission: Mission = match (text.as_deref(), live) {
            (None, Some(_)) => Mission::default(),
            (text, _) => {
                let text = text.unwrap_or("round");
                mission::mission(text).map_err(|error| format!("--mission {text}: {error}"))?
            }
        };
        if mission.is_empty() && live.is_none() {
            return Err("--mission: there is nothing to fly".into());
        }
        Ok(Setup {
            simulation,
            parameters,
            mission,
            faults: options.faults(Self::FAULTS)?,
            jitter: *jitter,
            live: live.clone(),
        })
    }

    fn options(setup: &Setup) -> FlightOptions {
        FlightOptions { start: setup.simulation.start, limit: LIMIT, jitter: setup.jitter }
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
