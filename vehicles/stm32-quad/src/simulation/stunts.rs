//! What a pilot does who is at home in ACRO: full sticks, flips, inverted flight, falls with the
//! throttle down, hard landings.
//!
//! All of it is flown with a sound vehicle, and no protection may say anything to it. Random, from
//! a seed.

use super::pilot::Sticks;
use stampfly_sim::Noise;
use stampfly_sim::sight::Seen;
use std::prelude::v1::*;

/// Random number stream of the stunts.
const STREAM: u64 = 1_202;
/// Below this height, m, the pilot catches it, in ANGLE; above this one, and slower than this, m/s,
/// the next stunt begins.
const CATCHES: f32 = 25.0;
const HIGH: f32 = 38.0;
const SLOW: f32 = 2.5;

/// What is flown beside places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stunt {
    /// Stunts at 40 m, for so many seconds.
    Freestyle(f32),
    /// It is let go of at this height above the ground, m.
    Drop(f32),
}

/// The sticks of one stunt after another.
#[derive(Debug)]
pub struct Stunts {
    noise: Noise,
    /// Sticks and for how long each, s; the next one is the last.
    script: Vec<(Sticks, f32)>,
    caught: bool,
}

impl Stunts {
    /// From a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { noise: Noise::new(seed, STREAM), script: Vec::new(), caught: true }
    }

    /// The sticks for the next `dt` seconds; `None` where the pilot catches it, and climbs back.
    pub fn next(&mut self, seen: &Seen, dt: f32) -> Option<Sticks> {
        let height = -seen.position.z;
        if height < CATCHES {
            (self.caught, self.script) = (true, Vec::new());
        }
        if self.caught {
            self.caught = height < HIGH || seen.velocity.norm() > SLOW;
            return None;
        }
        if self.script.is_empty() {
            self.script = self.stunt();
        }
        let (sticks, left) = self.script.last_mut()?;
        *left -= dt;
        let (sticks, left) = (*sticks, *left);
        if left <= 0.0 {
            self.script.pop();
        }
        Some(sticks)
    }

    /// One stunt, last part first.
    fn stunt(&mut self) -> Vec<(Sticks, f32)> {
        let side = if self.noise.chance(0.5) { 1.0 } else { -1.0 };
        let throttle = self.throttle();
        let acro = Sticks { acro: true, throttle, ..Sticks::REST };
        let over = if self.noise.chance(0.5) { Sticks { roll: side, ..acro } } else { Sticks { pitch: side, ..acro } };
        match (self.noise.unit() * 6.0) as u32 {
            // Once around.
            0 => vec![(over, 2.0)],
            // Onto its back, and on like that.
            1 => vec![(Sticks { throttle: self.throttle(), ..acro }, 1.2), (over, 1.0)],
            // On its side, and dead ahead.
            2 => vec![(Sticks { throttle: 1.0, ..acro }, 1.5), (Sticks { throttle: 1.0, ..over }, 0.36)],
            // It falls, and is caught in ANGLE.
            3 => vec![(Sticks { throttle: 0.6, ..Sticks::REST }, 0.6), (Sticks { throttle: 0.0, ..over }, 0.7)],
            // From one end to the other, faster than it follows.
            4 => {
                let other = Sticks { roll: -over.roll, pitch: -over.pitch, ..over };
                (0..14).map(|part| (if part % 2 == 0 { over } else { other }, 0.07)).collect()
            }
            // Every stick anywhere, in either mode.
            _ => (0..6).map(|_| (self.anywhere(), 0.1 + 0.5 * self.noise.unit() as f32)).collect(),
        }
    }

    fn anywhere(&mut self) -> Sticks {
        let [roll, pitch, yaw] = [(); 3].map(|()| self.end());
        let throttle = self.throttle();
        // Down and aside are the gestures that arm and disarm.
        let yaw = if throttle > 0.0 { yaw } else { 0.0 };
        Sticks { roll, pitch, yaw, throttle, acro: self.noise.chance(0.7) }
    }

    /// One end of a stick, the other, or its middle.
    fn end(&mut self) -> f32 {
        (self.noise.unit() * 3.0) as u32 as f32 - 1.0
    }

    fn throttle(&mut self) -> f32 {
        [0.0, 0.1, 0.3, 0.6, 1.0][(self.noise.unit() * 5.0) as usize % 5]
    }
}
