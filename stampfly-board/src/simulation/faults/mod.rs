//! What can go wrong in a flight of the StampFly: the table of faults, and where each acts.
//!
//! `stampfly faults` and `docs/reference/faults.md` print the table. Sensor faults act on samples on their way to the bus, behind
//! models and behind drivers alike; a dead bus also silences emulated chips; motor faults act on the plant.

mod act;
mod table;

pub use table::FAULTS;

use crate::topics::Id;
use act::{Act, Thing};
use stampfly_bus::Band;
use stampfly_sim::World;
use stampfly_sim::chips::{AttachedChips, Faults};
use stampfly_sim::fault::{Fault, Injector, Line};
use stampfly_sim::plant::{Plant, RotorFault};
use stampfly_types::{Instant, Message};
use std::vec;
use std::vec::Vec;
use table::acts;

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

    /// These, and every one there is with its usual value, on demand.
    pub fn on_demand(faults: &[Fault], start: Instant, seed: u64) -> Self {
        let faults: Vec<_> = faults.iter().copied().chain(FAULTS.iter().map(Fault::on_demand)).collect();
        Self::new(&faults, start, seed)
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
        let strikes = world.inspect_as(|plant: &Plant| plant.ground().strikes()).unwrap_or_default();
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
