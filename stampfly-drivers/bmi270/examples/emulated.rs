//! Runs the driver on a register-level emulation of a BMI270 on this PC: a vehicle at rest, 400
//! samples a second.
//!
//! `cargo run -p stampfly-bmi270 --example emulated-bmi270`, in the repository, which does not
//! contain Bosch's configuration file; the emulated chip accepts a substitute.

use stampfly_bmi270::{Axis, AxisMap, Bmi270, Config, Imu};
use stampfly_sim::chips::{self, SpiBus, stand_in_image};
use stampfly_sim::time::block_on;
use stampfly_sim::{Simulation, SimulationConfig};

/// The chip is mounted upside down: body = (y, x, −z) of the chip.
const AXES: AxisMap = AxisMap::new(Axis::PlusY, Axis::PlusX, Axis::MinusZ).expect("a rotation");

fn main() {
    let simulation = Simulation::new(&SimulationConfig::example());
    let (clock, image) = (simulation.clock.clone(), stand_in_image());
    let chip = chips::Bmi270::new(&simulation.world, &clock, 1, 1.0, &image);
    let (port, _) = SpiBus::new(&clock, 1).attach(10_000_000, chip);
    let mut imu = Bmi270::spi(port, clock.clone(), &image, AXES, Config::default());
    block_on(&clock, imu.self_test()).expect("the chip measures");
    let mut newest = block_on(&clock, imu.next()).expect("a sample").at;
    let first = newest;
    for number in 1..=400 {
        let sample = block_on(&clock, imu.next()).expect("a sample");
        newest = sample.at;
        if number % 40 == 0 {
            println!("{}: {} m/s², {} rad/s", sample.at, sample.data.accel, sample.data.gyro);
        }
        assert!((sample.data.accel.z + 9.81).abs() < 0.6, "not the weight of a vehicle that stands");
    }
    let took = newest.since(first).seconds();
    assert!((took - 1.0).abs() < 0.05, "400 samples in {took} s");
}
