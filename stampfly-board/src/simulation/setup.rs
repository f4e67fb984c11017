//! All that decides a flight of the StampFly.

use super::air::Air;
use super::mission::{self, Mission};
use super::pilot::mission_around;
use super::plant::PLANT;
use super::sensing::Sensing;
use crate::config::VehicleConfig;
use stampfly_sim::SimulationConfig;
use stampfly_sim::fault::Fault;
use stampfly_sim::sticks::Sticks;
use stampfly_sim::vehicle::Live;
use stampfly_types::Duration;
use stampfly_types::messages::FlightMode;
use std::vec::Vec;

/// Longest time before and after a stick file: power-on and arming, a climb to 20 m at 0.3 m/s, and
/// the longest landing.
const AROUND_STICKS: Duration = Duration::from_secs(240);

/// All that decides a flight.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The vehicle in its surroundings.
    pub simulation: SimulationConfig,
    /// The flight stack.
    pub vehicle: VehicleConfig,
    /// What to fly.
    pub mission: Mission,
    /// What the sensor tasks read.
    pub sensing: Sensing,
    /// What goes wrong.
    pub faults: Vec<Fault>,
    /// The mission is flown by a pilot in this mode; `None` for a ground station.
    pub pilot: Option<FlightMode>,
    /// A stick file is flown, instead of a mission. [`playing`](Self::playing) sets it, and what
    /// belongs to it.
    pub sticks: Option<Sticks>,
    /// Frames of the pilot and telemetry go as bytes of the secure session, with this on the air; `None`: as messages.
    pub air: Option<Air>,
    /// Is the vehicle watched by a motion capture system?
    pub cameras: bool,
    /// Seed of the executor's delays; `None` for an executor that is never late.
    pub jitter: Option<u64>,
    /// Other programs fly it, instead of a mission.
    pub live: Option<Live>,
    /// The flight is broken off after this long.
    pub limit: Duration,
}

impl Setup {
    /// The reference mission with this seed.
    #[must_use]
    pub fn reference(seed: u64) -> Self {
        let simulation = SimulationConfig { seed, ..SimulationConfig::new(PLANT) };
        Self {
            vehicle: VehicleConfig::default(),
            mission: Mission::parse(mission::REFERENCE).unwrap_or_else(|_| Mission { steps: Vec::new() }),
            sensing: Sensing::Models,
            faults: Vec::new(),
            pilot: None,
            sticks: None,
            air: None,
            cameras: false,
            jitter: None,
            live: None,
            limit: Duration::from_secs(180),
            simulation,
        }
    }

    /// The same, flown by other programs instead of a mission.
    #[must_use]
    pub fn flown_by(self, live: Live) -> Self {
        // For people who calibrate: the recorded flights know nothing of it.
        let simulation = SimulationConfig { imperfections: 1.0, ..self.simulation };
        Self { simulation, mission: Mission { steps: Vec::new() }, limit: live.limit, live: Some(live), ..self }
    }

    /// The same, flown by a stick file instead of a mission.
    #[must_use]
    pub fn playing(self, sticks: Sticks) -> Self {
        let limit = sticks.length() + AROUND_STICKS;
        Self { mission: mission_around(&sticks), limit, sticks: Some(sticks), ..self }
    }
}
