//! A hop: power until the range finder says half a metre, then a fall. Nobody controls the attitude, so it tips over,
//! which the sensors see, too.

use stampfly_drivers::{Imu, MotorOutputs, RangeFinder};
use stampfly_sim::time::Tasks;
use stampfly_sim::{Simulation, SimulationConfig};
use stampfly_types::messages::MotorOutput;
use stampfly_types::{Instant, frame};
use std::cell::Cell;

fn main() {
    let simulation = Simulation::new(&SimulationConfig { seed: 7, ..SimulationConfig::example() });
    let Simulation { clock, world, sensors } = simulation;
    let (mut imu, mut tof, mut motors) = (sensors.imu, sensors.tof, sensors.motors);
    let (range, felt) = (Cell::new(0.0), Cell::new(0.0));

    let mut tasks = Tasks::new(clock.clone());
    // Each sensor in a task of its own, as on the vehicle.
    tasks.spawn(async {
        loop {
            let Ok(sample) = tof.next().await;
            range.set(sample.data.distance);
        }
    });
    tasks.spawn(async {
        let mut climbing = true;
        loop {
            let Ok(sample) = imu.next().await;
            felt.set(-sample.data.accel.z);
            climbing &= range.get() < 0.5;
            let duty = if climbing { 0.85 } else { 0.0 };
            let Ok(()) = motors.write(&MotorOutput { duty: [duty; 8], count: 4, armed: true, ..Default::default() });
        }
    });

    println!("   time   height    range        felt   tilt");
    for tick in 1..=24 {
        tasks.run_until(Instant::from_millis(tick * 50));
        let truth = world.truth_at(clock.now());
        let height = -truth.position.z;
        println!(
            "{:4} ms {height:6.3} m {:6.3} m {:5.1} m/s² {:4.0}°  {}{}",
            tick * 50,
            range.get(),
            felt.get(),
            frame::tilt(&truth.attitude).to_degrees(),
            " ".repeat((height.max(0.0) * 40.0) as usize),
            if truth.contact { "_" } else { "o" },
        );
    }
}
