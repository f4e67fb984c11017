//! Two VL53L3CX emulated down to their registers, on this PC, on one bus: each is moved from the address that both start at.
//!
//! `cargo run -p stampfly-vl53l3cx --example emulated-vl53l3cx`, in the repository.

use stampfly_sim::chips::{self, I2cBus};
use stampfly_sim::sensors::Mount;
use stampfly_sim::time::block_on;
use stampfly_sim::{Simulation, SimulationConfig};
use stampfly_vl53l3cx::{BootAddress, Config, RangeFinder, Vl53l3cx};

fn main() {
    let simulation = Simulation::new(&SimulationConfig::example());
    let clock = simulation.clock.clone();
    let bus = I2cBus::new(&clock, 1);
    let [below, ahead] = [Mount::Bottom, Mount::Front].map(|mount| {
        let (chip, xshut) = chips::Vl53l3cx::new(&simulation.world, &clock, 1, mount);
        bus.attach(Vl53l3cx::BOOT_ADDRESS, chip);
        xshut
    });
    let boot = BootAddress::new();
    let mut below = Vl53l3cx::new(bus.clone(), below, &boot, 0x30, clock.clone(), Config::default());
    let mut ahead = Vl53l3cx::new(bus, ahead, &boot, 0x31, clock.clone(), Config::default());
    for _ in 0..10 {
        let floor = block_on(&clock, below.next()).expect("a sample").data;
        let wall = block_on(&clock, ahead.next()).expect("a sample").data;
        println!("{:.3} m to the floor, {:.3} m ahead (status {})", floor.distance, wall.distance, wall.status);
        assert!(floor.distance < 0.1, "the vehicle stands on it");
    }
}
