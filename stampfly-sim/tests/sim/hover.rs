//! Closed loop: with a small control law on the true state the vehicle stands, takes off, hovers
//! and lands.

use crate::pilot;
use stampfly_drivers::{Imu, MotorOutputs};
use stampfly_sim::plant::WindConfig;
use stampfly_sim::time::block_on;
use stampfly_sim::{Simulation, SimulationConfig, Truth};
use stampfly_types::Instant;
use stampfly_types::frame::tilt;
use stampfly_types::messages::MotorOutput;

/// Flies with the target height as a function of time (`None`: motors off) and returns the true
/// state at every sample.
fn fly(config: &SimulationConfig, seconds: u32, target: impl Fn(f32) -> Option<f32>) -> Vec<Truth> {
    let mut simulation = Simulation::new(config);
    let clock = simulation.clock.clone();
    block_on(&clock, async {
        let mut record = Vec::new();
        for _ in 0..seconds * 400 {
            let Ok(_) = simulation.sensors.imu.next().await;
            let truth = simulation.truth();
            let output = target(clock.now().since(Instant::ZERO).seconds())
                .map_or_else(MotorOutput::default, |d| pilot::fly(&truth, d));
            let Ok(()) = simulation.sensors.motors.write(&output);
            record.push(truth);
        }
        record
    })
}

#[test]
fn takes_off_hovers_in_gusts_and_lands() {
    for seed in 1..=5 {
        let config = SimulationConfig { seed, ..SimulationConfig::example() };
        let record = fly(&config, 16, |t| match t {
            t if t < 1.0 => None,
            t if t < 10.0 => Some(-0.8),
            t if t < 14.0 => Some(-0.8 + (t - 10.0) * 0.4),
            _ => None,
        });
        let at = |seconds: usize| &record[seconds * 400..(seconds + 1) * 400];
        let first = at(0)[..360].iter().find(|t| !(t.contact && t.velocity.norm() < 1e-3));
        assert_eq!(first, None, "stands still, seed {seed}, {:?}", at(0)[..360].iter().position(|t| Some(t) == first));
        for truth in at(8) {
            assert!(!truth.contact);
            assert!((truth.position.z + 0.8).abs() < 0.15, "height {} with seed {seed}", truth.position.z);
            assert!(truth.position.horizontal().norm() < 1.2, "drift {} with seed {seed}", truth.position.horizontal());
            assert!(tilt(&truth.attitude) < 0.3 && truth.rotor_speed.iter().all(|w| (2500.0..3600.0).contains(w)));
            assert!((3.8..4.3).contains(&truth.battery_voltage) && (3.0..5.0).contains(&truth.battery_current));
        }
        let end = record.last().expect("recorded");
        assert!(end.contact && end.velocity.norm() < 1e-3 && tilt(&end.attitude) < 0.02, "landed: {end:?}");
    }
}

#[test]
fn still_air_and_a_perfect_vehicle_give_a_perfect_hover() {
    let mut config = SimulationConfig { wind: WindConfig::CALM, ..SimulationConfig::example() };
    config.plant.manufacturing_spread = 0.0;
    config.pose = Some(stampfly_sim::plant::Pose::hovering(1.0));
    let record = fly(&config, 5, |_| Some(-1.0));
    assert!(record.iter().all(|t| (t.position.z + 1.0).abs() < 0.05 && t.position.horizontal().norm() < 1e-4));
}
