//! Runs the driver on a register-level emulation of an MPU-6000 on this PC: a vehicle at rest
//! measures 1 g.
//!
//! `cargo run -p stampfly-mpu6000 --example emulated-mpu6000`, in the repository.

use stampfly_mpu6000::{Axis, AxisMap, BusClock, Config, Imu, Mpu6000};
use stampfly_sim::chips::{self, SpiBus};
use stampfly_sim::time::block_on;
use stampfly_sim::{Simulation, SimulationConfig};

fn main() {
    let simulation = Simulation::new(&SimulationConfig::example());
    let clock = simulation.clock.clone();
    let chip = chips::Mpu6000::new(&simulation.world, &clock, 1, 1.0);
    let (device, _) = SpiBus::new(&clock, 1).attach(1_000_000, chip);
    let axes = AxisMap::new(Axis::PlusY, Axis::PlusX, Axis::MinusZ).expect("a rotation");
    let imu = Mpu6000::new(device, clock.clone(), axes, Config::default());
    let mut imu = imu.with_bus_clock(|device, clock| {
        device.set_frequency(match clock {
            BusClock::Setup => 1_000_000,
            BusClock::Data => 20_000_000,
        });
    });
    block_on(&clock, imu.self_test()).expect("both sensors answer as at the factory");
    let mut mean = 0.0;
    for number in 0..4_000 {
        let sample = block_on(&clock, imu.next()).expect("a sample");
        mean += sample.data.accel.z / 4_000.0;
        if number % 400 == 0 {
            let (accel, gyro) = (sample.data.accel, sample.data.gyro);
            println!("{}: {accel:.2?} m/s², {gyro:.3?} rad/s, {:.1} °C", sample.at, sample.data.temperature);
        }
    }
    println!("{mean:.2} m/s²");
    assert!((mean + 9.81).abs() < 1.2, "it stands");
}
