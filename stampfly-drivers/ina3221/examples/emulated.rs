//! Runs the driver on a register-level emulation of an INA3221 on this PC. Prints the battery state
//! of a simulated vehicle next to the true values.
//!
//! `cargo run -p stampfly-ina3221 --example emulated-ina3221`, in the repository.

use stampfly_ina3221::{Config, Ina3221, PowerMonitor};
use stampfly_sim::chips::{self, I2cBus};
use stampfly_sim::time::block_on;
use stampfly_sim::{Simulation, SimulationConfig};

fn main() {
    let simulation = Simulation::new(&SimulationConfig::example());
    let clock = simulation.clock.clone();
    let bus = I2cBus::new(&clock, 1);
    bus.attach(Ina3221::A0_GROUND, chips::Ina3221::new(&simulation.world, &clock, 1));
    let mut battery = Ina3221::new(bus, Ina3221::A0_GROUND, clock.clone(), Config::default());
    block_on(&clock, battery.self_test()).expect("the chip measures");
    for _ in 0..10 {
        let sample = block_on(&clock, battery.next()).expect("a sample");
        let truth = simulation.truth().battery_voltage;
        println!("{}: {:.3} V, {:.3} A; in truth {truth:.3} V", sample.at, sample.data.voltage, sample.data.current);
        assert!((sample.data.voltage - truth).abs() < 0.03, "off by more than 30 mV");
    }
}
