//! Runs the driver on a register-level emulation of a BMM150 on this PC, on I2C and on SPI: both
//! measure the same field.
//!
//! `cargo run -p stampfly-bmm150 --example emulated-bmm150`, in the repository.

use stampfly_bmm150::{AxisMap, Bmm150, Config, Magnetometer};
use stampfly_sim::chips::{self, I2cBus, SpiBus};
use stampfly_sim::time::block_on;
use stampfly_sim::{Simulation, SimulationConfig};

fn main() {
    let simulation = Simulation::new(&SimulationConfig::example());
    let clock = simulation.clock.clone();
    let bus = I2cBus::new(&clock, 1);
    bus.attach(Bmm150::ALL_LOW, chips::Bmm150::new(&simulation.world, &clock, 1));
    let (port, _) = SpiBus::new(&clock, 1).attach(10_000_000, chips::Bmm150::new(&simulation.world, &clock, 1));
    let mut on_i2c = Bmm150::i2c(bus, Bmm150::ALL_LOW, clock.clone(), AxisMap::IDENTITY, Config::default());
    let mut on_spi = Bmm150::spi(port, clock.clone(), AxisMap::IDENTITY, Config::default());
    for _ in 0..10 {
        let first = block_on(&clock, on_i2c.next()).expect("a sample").data.field;
        let second = block_on(&clock, on_spi.next()).expect("a sample").data.field;
        println!("{first} µT on I2C, {second} µT on SPI");
        assert!((10.0..100.0).contains(&first.norm()) && (first - second).norm() < 5.0, "not one field");
    }
}
