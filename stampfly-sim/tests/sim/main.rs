//! Tests of vehicles, sensors, emulated chips, and the real drivers on them. One binary, because
//! each further one would link the simulator again: `cargo test -p stampfly-sim --test sim chips`
//! runs one folder.

mod aeroplane;
mod agreement;
mod asked_at_once;
mod chips;
mod compensation;
mod conditions;
mod determinism;
mod drivers;
mod hover;
mod mounting;
mod outdoors;
mod physics;
mod pilot;
mod scenario;
mod sensors;
mod specimens;

use stampfly_sim::plant::WindConfig;
use stampfly_sim::{Simulation, SimulationConfig};

/// A vehicle on the floor in still air.
fn standing() -> Simulation {
    Simulation::new(&SimulationConfig { wind: WindConfig::CALM, ..SimulationConfig::example() })
}
