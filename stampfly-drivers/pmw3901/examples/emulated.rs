//! Runs the driver on a register-level emulation of a PMW3901 on this PC: a vehicle at rest
//! measures no flow.
//!
//! `cargo run -p stampfly-pmw3901 --example emulated-pmw3901`, in the repository.

use stampfly_pmw3901::{AxisMap, Config, OpticalFlow, Pmw3901};
use stampfly_sim::chips::{self, SpiBus};
use stampfly_sim::time::block_on;
use stampfly_sim::{Simulation, SimulationConfig};

fn main() {
    let simulation = Simulation::new(&SimulationConfig::example());
    let clock = simulation.clock.clone();
    let (port, _) = SpiBus::new(&clock, 1).attach(2_000_000, chips::Pmw3901::new(&simulation.world, &clock, 1));
    let mut flow = Pmw3901::new(port, clock.clone(), AxisMap::IDENTITY, Config::default());
    block_on(&clock, flow.self_test()).expect("the chip keeps its settings and sees something");
    for _ in 0..10 {
        let sample = block_on(&clock, flow.next()).expect("a sample");
        let rate = sample.data.delta_x.abs().max(sample.data.delta_y.abs()) / sample.data.interval;
        println!("{}: {rate:.2} rad/s, quality {}", sample.at, sample.data.quality);
        assert!(rate < 2.0, "it stands");
    }
}
