//! Runs two drivers on register-level emulations of two VL53L3CX on one bus, on this PC. Each chip
//! is moved from the boot address that both start at.
//!
//! `cargo run -p stampfly-vl53l3cx --example emulated-vl53l3cx`, in the repository.

use stampfly_sim::chips::{self, Flaw, I2cBus, Nonsense};
use stampfly_sim::sensors::Mount;
use stampfly_sim::time::block_on;
use stampfly_sim::{Simulation, SimulationConfig};
use stampfly_vl53l3cx::{BootAddress, ChipError, Config, RangeFinder, Ranging, Vl53l3cx};

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

    // A third chip yields no useful distances by itself. There is a floor in range, so the driver
    // detects this and changes to histograms.
    let bus = I2cBus::new(&clock, 2);
    let (chip, xshut) = chips::Vl53l3cx::new(&simulation.world, &clock, 2, Mount::Bottom);
    bus.attach(Vl53l3cx::BOOT_ADDRESS, chip).set_flaw(Some(Flaw::LightMode(Nonsense::Blind)));
    let mut odd = Vl53l3cx::new(bus, xshut, &boot, 0x30, clock.clone(), Config::automatic(true));
    let floor = loop {
        match block_on(&clock, odd.next()) {
            Ok(sample) if sample.data.valid => break sample.data,
            Ok(_) | Err(ChipError::Implausible) => {}
            Err(error) => panic!("{error}"),
        }
    };
    println!("{:.3} m to the floor by {:?}, because of {:?}", floor.distance, odd.ranging(), odd.doubt());
    assert!(floor.distance < 0.1 && odd.ranging() == Ranging::Histogram);
}
