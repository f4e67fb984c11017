//! What decides a flight of the quadcopter.

use super::stunts::Stunt;
use crate::parameters::Parameters;
use stampfly_sim::SimulationConfig;
use stampfly_sim::fault::Fault;
use stampfly_sim::sight::Places;
use stampfly_sim::sticks::Sticks;
use stampfly_sim::vehicle::Live;
use std::prelude::v1::*;

/// All that decides a flight.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The world, from one seed.
    pub simulation: SimulationConfig,
    /// The vehicle's parameters at power-on.
    pub parameters: Parameters,
    /// What to fly; nothing is to stand with the transmitter on.
    pub mission: Places,
    /// A stick file is flown, instead of the mission.
    pub sticks: Option<Sticks>,
    /// In ACRO, not in ANGLE.
    pub acro: bool,
    /// What is flown besides.
    pub stunt: Option<Stunt>,
    /// What goes wrong.
    pub faults: Vec<Fault>,
    /// The inertial sensor is a chip under its driver, and no model of its samples. The radio always is.
    pub chips: bool,
    /// Seed of the executor's delays.
    pub jitter: Option<u64>,
    /// The programs at its ports, if there are.
    pub live: Option<Live>,
}
