//! What can go wrong in a flight of the StampFly: the table of faults, and where each acts.
//!
//! `stampfly faults` and `docs/faults.md` print the table. Sensor faults act on samples on their way to the bus, behind
//! models and behind drivers alike; a dead bus also silences emulated chips; motor faults act on the plant.

mod table;

pub use table::FAULTS;

use crate::topics::Id;
use stampfly_bus::Band;
use stampfly_sim::World;
use stampfly_sim::chips::{AttachedChips, Faults};
use stampfly_sim::fault::{Distortion, Fault, Injector, Line};
use stampfly_sim::plant::{Beyond, Hand, Motion, RotorFault, Scene};
use stampfly_types::{Instant, Message};
use std::vec;
use std::vec::Vec;
use table::acts;

/// Where a fault acts, and how.
#[derive(Clone, Copy, Debug)]
enum Act {
    /// Samples from outside, on their way to a topic.
    Sample(Id, Distortion),
    /// The chips on a bus do not answer: only where there are chips.
    Bus(fn(&AttachedChips) -> Vec<&stampfly_sim::chips::Attached>),
    Rotor(usize, RotorFault),
    Scene(Thing),
    HoldUp(Band, Option<f64>),
}

/// What stands in the way.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Thing {
    Edge(f64),
    Slope(f64),
    FloorVelocity(f64),
    Ceiling(f64),
    Wall(f64),
    /// For so long, s.
    Hand(f64),
}

impl Thing {
    /// The share of it that is there so long after it began, s.
    fn share(self, seconds: f64) -> f64 {
        match self {
            Self::Slope(_) => (seconds / TILTS).min(1.0),
            Self::Hand(holds) if seconds >= holds => 0.0,
            _ => 1.0,
        }
    }

    /// Puts this share of it there, relative to the vehicle, or takes it away.
    fn put(self, scene: &mut Scene, motion: &Motion, share: f64) {
        let there = share > 0.0;
        match self {
            Self::Edge(drop) => scene.edge = there.then(|| (Beyond::ahead_of(motion, EDGE_AHEAD), drop)),
            Self::Slope(rise) => {
                if scene.slope == [0.0; 2] {
                    scene.pivot = [motion.position.x, motion.position.y];
                }
                scene.slope = [rise * share, 0.0];
            }
            Self::FloorVelocity(north) => scene.floor_velocity = if there { [north, 0.0] } else { [0.0; 2] },
            Self::Ceiling(above) => scene.ceiling = there.then(|| above - motion.position.z),
            Self::Wall(ahead) => scene.wall = there.then(|| Beyond::ahead_of(motion, ahead)),
            Self::Hand(_) => {
                scene.hand = there.then_some(Hand { position: motion.position, attitude: motion.attitude });
            }
        }
    }
}

/// A floor tilts in this time, s: at once it would throw off what stands on it.
const TILTS: f64 = 1.0;
/// How far ahead an edge is, m: no vehicle of this size stands on it.
const EDGE_AHEAD: f64 = 0.3;

/// What is wrong in one flight, and where it acts.
pub(super) struct Wrong {
    pub injector: Injector,
    acts: Vec<(usize, Act)>,
    seed: u64,
    /// The share of each act beside the bus that was in force at the last look.
    in_force: Vec<f64>,
    /// Steps in which an obstacle pushed, at the last look.
    strikes: u64,
}

impl Wrong {
    /// These faults, in a flight with this start and seed.
    pub fn new(faults: &[Fault], start: Instant, seed: u64) -> Self {
        let acts: Vec<_> = faults
            .iter()
            .enumerate()
            .flat_map(|(place, fault)| acts(fault).into_iter().map(move |act| (place, act)))
            .collect();
        Self { injector: Injector::new(start, faults), in_force: vec![0.0; acts.len()], strikes: 0, acts, seed }
    }

    /// The way to a topic, or from the telemetry's to the radio.
    pub fn line<M: Message>(&self, topic: Id) -> Line<M> {
        let on_it = |(place, act): &(usize, Act)| match act {
            Act::Sample(id, distortion) if *id == topic => Some((*place, *distortion)),
            _ => None,
        };
        let distortions: Vec<_> = self.acts.iter().filter_map(on_it).collect();
        Line::new(&self.injector, &distortions, self.seed)
    }

    /// Switches what acts beside the bus on and off. Call it every turn.
    pub fn act(&mut self, now: Instant, world: &World, chips: Option<&AttachedChips>) {
        let strikes = world.inspect(|plant| plant.ground().strikes());
        let struck = strikes > self.strikes;
        self.strikes = strikes;
        for ((place, act), in_force) in self.acts.iter().zip(&mut self.in_force) {
            let active = self.injector.is_active(*place, now);
            let is_obstacle = matches!(act, Act::Scene(Thing::Ceiling(_) | Thing::Wall(_)));
            if struck && is_obstacle {
                self.injector.note_change(*place);
            }
            let since = self.injector.begins(*place).map_or(0.0, |begun| now.since(begun).seconds_f64());
            let share = match act {
                _ if !active => 0.0,
                Act::Scene(thing) => thing.share(since),
                _ => 1.0,
            };
            if share == *in_force {
                continue;
            }
            *in_force = share;
            match act {
                Act::Rotor(rotor, fault) => {
                    world.set_rotor_fault(now, *rotor, if active { *fault } else { RotorFault::NONE });
                }
                Act::Scene(thing) => world.change_scene(now, |scene, motion| thing.put(scene, motion, share)),
                Act::Bus(attached) => {
                    let Some(chips) = chips else { continue };
                    let faults = Faults { dead: active, ..Faults::default() };
                    attached(chips).into_iter().for_each(|chip| chip.set_faults(faults));
                }
                _ => continue,
            }
            if active && !is_obstacle {
                self.injector.note_change(*place);
            }
        }
    }

    /// Is this band's processor held up?
    pub fn is_held_up(&self, band: Band, now: Instant) -> bool {
        let mut held_up = false;
        for (place, act) in &self.acts {
            let Act::HoldUp(which, seconds) = act else { continue };
            let since = self.injector.begins(*place).filter(|_| *which == band && self.injector.is_active(*place, now));
            if since.is_some_and(|begun| seconds.is_none_or(|seconds| now.since(begun).seconds_f64() < seconds)) {
                self.injector.note_change(*place);
                held_up = true;
            }
        }
        held_up
    }
}

#[cfg(test)]
mod tests;
