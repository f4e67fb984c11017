//! What the driver examples need on a PC: the StampFly's emulated chips on virtual time, and a hand that moves it all.
//!
//! The hand is a controller that knows the truth, which no flight controller does; it stands for the person who tilts,
//! lifts and turns the board while an example runs there.
#![allow(dead_code, reason = "not every example moves the vehicle")]

use embassy_futures::select::{Either, select};
use stampfly_sim::chips::{Board, stand_in_image};
use stampfly_sim::plant::{PlantParameters, Pose, WindConfig};
use stampfly_sim::time::block_on;
use stampfly_sim::{Simulation, SimulationConfig};
use stampfly_types::Duration;
use std::io::Write;

/// What the hand does.
#[derive(Clone, Copy, Debug, Default)]
pub struct Hand {
    /// Upwards, m/s.
    pub climb: f64,
    /// rad.
    pub roll: f64,
    /// rad, nose up.
    pub pitch: f64,
    /// To the right, seen from above, rad/s.
    pub turn: f64,
}

/// A vehicle in still air, at `pose` or else on the floor, and its chips. `image` is what the inertial sensor takes for
/// its configuration file.
pub fn vehicle(pose: Option<Pose>) -> (Simulation, Board, Vec<u8>) {
    // Four equal motors, so that a simple hand keeps it level.
    let plant = PlantParameters { manufacturing_spread: 0.0, ..PlantParameters::EXAMPLE };
    let config = SimulationConfig { wind: WindConfig::CALM, plant, pose, ..SimulationConfig::example() };
    let simulation = Simulation::new(&config);
    let image = stand_in_image();
    let board = Board::new(&simulation.world, &simulation.clock, &config, &image);
    (simulation, board, image)
}

/// Runs an example to its end while a hand moves the vehicle: `script` says how, by the time in seconds; `None` leaves it
/// alone with its motors off.
pub fn run<T>(simulation: &Simulation, script: impl Fn(f64) -> Option<Hand>, example: impl Future<Output = T>) -> T {
    let (clock, world) = (&simulation.clock, &simulation.world);
    let hand = async {
        let mut hover = 0.55;
        loop {
            let now = clock.now();
            let motion = world.motion_at(now);
            let duty = script(now.seconds_f64()).map_or([0.0; 4], |wanted| {
                let (roll, pitch, _) = motion.attitude.euler_angles();
                let climb = wanted.climb + motion.velocity.z;
                // Angles and rates per duty: from the vehicle's inertia and thrust, and quick enough for a demonstration.
                let right_down = 0.05 * (wanted.roll - roll) - 0.008 * motion.rate.x;
                let nose_up = 0.05 * (wanted.pitch - pitch) - 0.008 * motion.rate.y;
                let to_the_right = 0.03 * (wanted.turn - motion.rate.z);
                hover += 0.001 * climb;
                let lift = hover + 0.3 * climb;
                [
                    lift - right_down + nose_up + to_the_right,
                    lift - right_down - nose_up - to_the_right,
                    lift + right_down - nose_up + to_the_right,
                    lift + right_down + nose_up - to_the_right,
                ]
                .map(|duty: f64| duty.clamp(0.0, 1.0))
            });
            world.set_duty(now, duty);
            clock.sleep_until(now + Duration::from_micros(2_500)).await;
        }
    };
    match block_on(clock, select(example, hand)) {
        Either::First(outcome) => outcome,
        Either::Second(never) => never,
    }
}

/// The terminal, as something the examples can write on.
#[derive(Debug)]
pub struct Terminal;

impl core::fmt::Write for Terminal {
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        std::io::stdout().write_all(text.as_bytes()).map_err(|_| core::fmt::Error)
    }
}
