//! An aeroplane glides: it flies level at 10 m/s, after five seconds the motor stops, and the elevator stays where it was. What satellite receiver and
//! pitot tube say stands beside what is true. Nobody controls it.

use stampfly_drivers::{Airspeed, Gnss, MotorOutputs, ServoOutputs};
use stampfly_sim::plant::{Aeroplane, AeroplaneParameters, Surface, TrimError, WindConfig};
use stampfly_sim::sensors::{AirspeedModel, GnssConfig, GnssModel, ServoModel};
use stampfly_sim::time::Tasks;
use stampfly_sim::{Simulation, SimulationConfig};
use stampfly_types::messages::{GnssFix, MotorOutput, ServoOutput};
use stampfly_types::{Duration, Instant, Origin, frame, math};
use std::cell::Cell;

/// A field near Kanazawa, 30 m above the sea.
const ORIGIN: Origin = Origin { latitude: 365_440_000, longitude: 1_367_050_000, altitude: 30_000 };
const SERVOS: [Surface; 4] = [Surface::RightAileron, Surface::LeftAileron, Surface::Elevator, Surface::Rudder];
const POWER_OFF: Instant = Instant::from_secs(5);

fn main() -> Result<(), TrimError> {
    let parameters = AeroplaneParameters { manufacturing_spread: 0.0, ..AeroplaneParameters::EXAMPLE };
    let level = Aeroplane::trim(&parameters, 10.0, 0.0)?;
    println!("level at 10 m/s: angle of attack {:.1}°, {:.2} N of thrust", level.alpha.to_degrees(), level.thrust);
    let config = SimulationConfig {
        pose: Some(level.pose(60.0, 0.0)),
        wind: WindConfig::CALM,
        ..SimulationConfig::new(parameters)
    };
    let Simulation { clock, world, sensors } = Simulation::new(&config);
    world.change(clock.now(), |plane: &mut Aeroplane| plane.settle(&level));

    let mut servos = ServoModel::new(&world, &clock, &SERVOS);
    let mut output = ServoOutput { count: SERVOS.len() as u8, ..ServoOutput::default() };
    for (deflection, surface) in output.deflection.iter_mut().zip(SERVOS) {
        *deflection = level.surfaces[surface as usize] as f32;
    }
    let Ok(()) = servos.write(&output);

    let receiver = GnssConfig { first_fix: 2.0, ..GnssConfig::m8(ORIGIN) };
    let mut gnss = GnssModel::new(&world, &clock, config.seed, &receiver);
    let mut tube = AirspeedModel::new(&world, &clock, config.seed);
    let (mut motors, truth) = (sensors.motors, world.clone());
    let (altitude, airspeed) = (Cell::new(None), Cell::new(0.0));
    let mut tasks = Tasks::new(clock.clone());
    tasks.spawn(async {
        loop {
            let Ok(sample) = gnss.next().await;
            altitude.set((sample.data.fix == GnssFix::ThreeDimensional).then_some(sample.data.altitude));
        }
    });
    tasks.spawn(async {
        loop {
            let Ok(sample) = tube.next().await;
            airspeed.set(math::sqrt(2.0 * sample.data.pressure.max(0.0) / 1.225));
        }
    });
    tasks.spawn(async {
        loop {
            // The voltage sinks while the battery is used.
            let duty = level.voltage / truth.inspect(|body| body.battery().voltage());
            let duty = if clock.now() < POWER_OFF { duty as f32 } else { 0.0 };
            let Ok(()) = motors.write(&MotorOutput { duty: [duty; 8], count: 1, armed: true, ..Default::default() });
            clock.sleep_until(clock.now() + Duration::from_millis(20)).await;
        }
    });

    println!("   time   height   satellites  airspeed      tube   sinks    pitch");
    for second in 1..=24 {
        tasks.run_until(Instant::from_secs(second));
        let now = clock.now();
        let motion = world.truth_at(now);
        let true_airspeed = world.inspect_as(Aeroplane::airspeed).unwrap_or_default();
        let above_field = altitude.get().map(|metres| metres - ORIGIN.altitude as f32 * 1e-3);
        println!(
            "{second:5} s {:6.1} m   {:>8}  {true_airspeed:5.1} m/s {:5.1} m/s {:5.2} m/s {:6.1}°{}",
            -motion.position.z,
            above_field.map_or("no fix".into(), |metres| format!("{metres:.1} m")),
            airspeed.get(),
            motion.velocity.z,
            frame::roll_pitch_yaw(&motion.attitude)[1].to_degrees(),
            if motion.contact { "  on the ground" } else { "" },
        );
    }
    Ok(())
}
