//! Sticks drawn from a seed: any position, duration and mode, with switch changes in between.
//!
//! Covers what a pilot's hands can do at most, not what they usually do. In modes that hold height
//! each stick is centred, at a stop, or anywhere. In manual modes the throttle stays near hover
//! most of the time, because few vehicles survive anything else for long; the file defines hover as
//! the centre ([`Throttle::of_file`](super::Throttle)).

use super::file::Row;
use crate::noise::Noise;
use stampfly_types::Duration;
use stampfly_types::messages::{FlightMode, PilotInput};
use std::vec::Vec;

/// Random number stream, different from those of vehicles, missions, faults and campaigns.
const STREAM: u64 = 1_200;
/// Range of the duration, s.
const LENGTH: [f64; 2] = [5.0, 25.0];
/// Range of the time for which sticks hold a position, s: from one transmitter frame to a tilt that
/// crosses a room.
const HOLDS: [f64; 2] = [0.02, 2.0];
/// Probability that a new position comes with another mode, and with a flip request.
const SWITCHES: f64 = 0.1;
const FLIPS: f64 = 0.02;
/// Probability of a start on the ground, and the time with lowest throttle then, s.
const ON_GROUND: f64 = 0.3;
const LOWEST_FOR: f64 = 0.5;
/// Range of the throttle around hover in manual modes.
const THROTTLE: f64 = 0.3;
/// Probability of a throttle at a stop in manual modes, and its longest duration, s.
const PUNCHES: f64 = 0.1;
const PUNCH: f64 = 0.5;

/// The rows of this seed, armed from the first row on.
pub(super) fn rows(seed: u64) -> Vec<Row> {
    let mut dice = Dice(Noise::new(seed, STREAM));
    let mut mode = dice.mode();
    let mut rows = Vec::new();
    let mut time = 0.0;
    if dice.0.chance(ON_GROUND) {
        rows.push(row(0.0, PilotInput { throttle: -1.0, mode, arm: true, ..PilotInput::default() }));
        time = LOWEST_FOR;
    }
    let end = time + dice.between(LENGTH);
    while time < end {
        if dice.0.chance(SWITCHES) {
            mode = dice.mode();
        }
        // Uniform in the logarithm: short and long holds are equally likely.
        let mut holds = HOLDS[0] * (HOLDS[1] / HOLDS[0]).powf(dice.0.unit());
        let throttle = if !mode.is_manual() {
            dice.stick()
        } else if dice.0.chance(PUNCHES) {
            holds = holds.min(PUNCH);
            dice.stop()
        } else {
            dice.between([-THROTTLE, THROTTLE]) as f32
        };
        let [roll, pitch, yaw] = [(); 3].map(|()| dice.stick());
        let input = PilotInput { throttle, roll, pitch, yaw, mode, arm: true, ..PilotInput::default() };
        rows.push(Row { flip: dice.0.chance(FLIPS), ..row(time, input) });
        time += holds;
    }
    rows
}

/// Rounds to whole milliseconds, so that a file needs three decimals.
fn row(time: f64, input: PilotInput) -> Row {
    Row { at: Duration::from_millis((1e3 * time).round() as u64), input, flip: false, land: false }
}

struct Dice(Noise);

impl Dice {
    fn between(&mut self, [low, high]: [f64; 2]) -> f64 {
        low + (high - low) * self.0.unit()
    }

    fn stop(&mut self) -> f32 {
        if self.0.chance(0.5) { 1.0 } else { -1.0 }
    }

    /// Centred, at a stop, or anywhere.
    fn stick(&mut self) -> f32 {
        match self.0.unit() {
            place if place < 0.3 => 0.0,
            place if place < 0.6 => self.stop(),
            _ => self.between([-1.0, 1.0]) as f32,
        }
    }

    /// Modes that hold height are more than twice as likely as the others, because the vehicle's
    /// own control acts in them.
    fn mode(&mut self) -> FlightMode {
        match self.0.unit() {
            place if place < 0.35 => FlightMode::PosHold,
            place if place < 0.7 => FlightMode::AltHold,
            place if place < 0.9 => FlightMode::Stabilize,
            _ => FlightMode::Acro,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_the_seeds_and_go_everywhere() {
        let all: Vec<_> = (1..50).flat_map(rows).collect();
        assert_eq!(rows(7), rows(7));
        assert_ne!(rows(7), rows(8));
        for stick in [|row: &Row| row.input.roll, |row: &Row| row.input.throttle] {
            for place in [-1.0, 0.0, 1.0] {
                assert!(all.iter().any(|row| stick(row) == place), "{place}");
            }
        }
        let modes = [FlightMode::PosHold, FlightMode::AltHold, FlightMode::Stabilize, FlightMode::Acro];
        assert!(modes.iter().all(|mode| all.iter().any(|row| row.input.mode == *mode)));
        assert!(all.iter().any(|row| row.flip) && all.iter().all(|row| row.input.arm && !row.input.kill));
    }

    #[test]
    fn time_never_goes_back_and_they_last_as_long_as_they_say() {
        for seed in 0..50 {
            let rows = rows(seed);
            assert!(rows.windows(2).all(|pair| pair[0].at <= pair[1].at), "seed {seed}");
            let last = rows.last().expect("rows").at.seconds();
            assert!((3.0..26.0).contains(&last), "seed {seed}: {last} s");
        }
    }
}
