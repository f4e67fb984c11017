//! Measures how much faster than real time the simulator runs: `cargo run --release -p stampfly-sim
//! --example speed`.
//!
//! Flies one vehicle with a task per sensor and a small controller on the true state for one minute
//! of simulated time, and prints the wall-clock time per control period of 2.5 ms.

#[path = "../tests/sim/pilot.rs"]
mod pilot;

use stampfly_drivers::{Barometer, Imu, Magnetometer, MotorOutputs, OpticalFlow, PowerMonitor, RangeFinder};
use stampfly_sim::plant::Pose;
use stampfly_sim::time::Tasks;
use stampfly_sim::{Simulation, SimulationConfig};
use stampfly_types::Instant;

const SECONDS: u64 = 60;

fn main() {
    for (name, vibration) in [("with vibration", 1.0), ("without vibration", 0.0)] {
        let config = SimulationConfig { vibration, pose: Some(Pose::hovering(1.0)), ..SimulationConfig::example() };
        let Simulation { clock, world, sensors } = Simulation::new(&config);
        let (mut imu, mut tof, mut flow) = (sensors.imu, sensors.tof, sensors.flow);
        let (mut mag, mut baro, mut power, mut motors) = (sensors.mag, sensors.baro, sensors.power, sensors.motors);
        let mut tasks = Tasks::new(clock.clone());
        let truth = world.clone();
        tasks.spawn(async move {
            loop {
                let Ok(sample) = imu.next().await;
                let Ok(()) = motors.write(&pilot::fly(&truth.truth_at(sample.at), -1.0));
            }
        });
        tasks.spawn(async move { while tof.next().await.is_ok() {} });
        tasks.spawn(async move { while flow.next().await.is_ok() {} });
        tasks.spawn(async move { while mag.next().await.is_ok() {} });
        tasks.spawn(async move { while baro.next().await.is_ok() {} });
        tasks.spawn(async move { while power.next().await.is_ok() {} });
        let begin = std::time::Instant::now();
        tasks.run_until(Instant::from_secs(SECONDS));
        let spent = begin.elapsed().as_secs_f64();
        println!(
            "{name}: {:.0} times real time, {:.2} us per 2.5 ms, height {:.2} m",
            SECONDS as f64 / spent,
            spent / (SECONDS as f64 * 400.0) * 1e6,
            -world.truth_at(clock.now()).position.z
        );
    }
}
