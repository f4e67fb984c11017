//! A stranger's program: a second of standing on the floor.

use stampfly_sim::{Simulation, SimulationConfig};
use stampfly_types::Instant;

fn main() {
    let simulation = Simulation::new(&SimulationConfig::example());
    let truth = simulation.world.truth_at(Instant::from_secs(1));
    assert!(truth.contact && truth.velocity.norm() < 1e-3, "{truth:?}");
}
