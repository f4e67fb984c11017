//! Runs the driver on a register-level emulation of a BMP280 on this PC. Prints its measurements of
//! a simulated day next to the true values.
//!
//! `cargo run -p stampfly-bmp280 --example emulated-bmp280`, in the repository.

use stampfly_bmp280::{Barometer, Bmp280, Config};
use stampfly_sim::chips::{self, I2cBus};
use stampfly_sim::time::block_on;
use stampfly_sim::{Simulation, SimulationConfig};

fn main() {
    let simulation = Simulation::new(&SimulationConfig::example());
    let clock = simulation.clock.clone();
    let bus = I2cBus::new(&clock, 1);
    bus.attach(Bmp280::SDO_LOW, chips::Bmp280::new(&simulation.world, &clock, 1));
    let mut barometer = Bmp280::i2c(bus, Bmp280::SDO_LOW, clock.clone(), Config::default());
    block_on(&clock, barometer.self_test()).expect("the chip measures");
    let first = block_on(&clock, barometer.next()).expect("a sample").data;
    for _ in 0..10 {
        let sample = block_on(&clock, barometer.next()).expect("a sample");
        println!("{}: {:.0} Pa, {:.1} °C", sample.at, sample.data.pressure, sample.data.temperature);
        let climbed = sample.data.altitude - first.altitude;
        assert!(climbed.abs() < 0.5, "the vehicle stands, but the driver says that it rose by {climbed} m");
    }
}
