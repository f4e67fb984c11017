//! Where a fault acts: on samples, chips, rotors, surroundings, or the executor.

use crate::topics::Id;
use stampfly_bus::Band;
use stampfly_sim::chips::{Attached, AttachedChips};
use stampfly_sim::fault::Distortion;
use stampfly_sim::plant::{Beyond, Hand, Motion, RotorFault, Scene};
use std::vec::Vec;

/// Where a fault acts, and how.
#[derive(Clone, Copy, Debug)]
pub(super) enum Act {
    /// Samples from outside, on their way to a topic.
    Sample(Id, Distortion),
    /// The chips on a bus do not answer: only where there are chips.
    Bus(fn(&AttachedChips) -> Vec<&Attached>),
    Rotor(usize, RotorFault),
    Scene(Thing),
    HoldUp(Band, Option<f64>),
}

/// What stands in the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Thing {
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
    pub(super) fn share(self, seconds: f64) -> f64 {
        match self {
            Self::Slope(_) => (seconds / TILTS).min(1.0),
            Self::Hand(holds) if seconds >= holds => 0.0,
            _ => 1.0,
        }
    }

    /// Puts this share of it there, relative to the vehicle, or takes it away.
    pub(super) fn put(self, scene: &mut Scene, motion: &Motion, share: f64) {
        let there = share > 0.0;
        match self {
            // It stays: a floor that came back would strike what is below it.
            Self::Edge(drop) if there => scene.edge = Some((Beyond::ahead_of(motion, EDGE_AHEAD), drop)),
            Self::Edge(_) => {}
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
