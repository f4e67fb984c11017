//! What decides a flight of the aircraft.

use crate::Parameters;
use stampfly_sim::SimulationConfig;
use stampfly_sim::fault::Fault;
use stampfly_sim::plant::AeroplaneParameters;
use stampfly_sim::station::Mission;
use stampfly_sim::vehicle::Live;
use std::prelude::v1::*;

/// All that decides a flight.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The world, from one seed.
    pub simulation: SimulationConfig<AeroplaneParameters>,
    /// The vehicle's parameters at power-on.
    pub parameters: Parameters,
    /// What to fly; nothing is to stand.
    pub mission: Mission,
    /// What goes wrong.
    pub faults: Vec<Fault>,
    /// Seed of the executor's delays.
    pub jitter: Option<u64>,
    /// The programs at its ports, if there are.
    pub live: Option<Live>,
}
