//! What rotors and their surroundings do to each other through the air, beyond drag and the cushion over the floor.
//!
//! | part | what it is |
//! |---|---|
//! | [`near`] | ceilings and walls draw |
//! | [`vortex_ring`] | who sinks into his own wake loses thrust |
//! | [`room`] | the wake comes back from the walls of a small room |
//!
//! All of it goes by the induced velocity of the rotors in a hover, `v = √(T / 2ρA)` (momentum theory): 7.3 m/s for a StampFly, whose discs
//! are small for its weight, and half of that for most vehicles of its kind. None of it is there unless the [conditions](Conditions) have it.

mod near;
mod room;
mod vortex_ring;

use super::{DT, Motion, PlantParameters, ROTORS, Scene};
use crate::conditions::Conditions;
use crate::noise::{Noise, Stream};
use nalgebra::Vector3;
use room::Room;
use vortex_ring::VortexRing;

/// Density of air in a room, kg/m³.
const DENSITY: f64 = 1.2;

/// What the air does beyond the plain plant.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Air {
    radius: f64,
    /// Area of all rotors, m².
    area: f64,
    /// Induced velocity in a hover, m/s.
    induced: f64,
    ceiling: f64,
    wall: f64,
    vortex_ring: Option<VortexRing>,
    room: Option<Room>,
}

/// Force and torque on the body, in its frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Push {
    pub force: Vector3<f64>,
    pub torque: Vector3<f64>,
}

impl Air {
    /// `None` when the conditions have none of it.
    pub fn new(p: &PlantParameters, conditions: &Conditions, seed: u64) -> Option<Self> {
        let area = ROTORS as f64 * core::f64::consts::PI * p.rotor_radius * p.rotor_radius;
        let weight = p.mass * p.gravity;
        let induced = (weight / (2.0 * DENSITY * area)).sqrt();
        let vortex_ring = (conditions.vortex_ring > 0.0)
            .then(|| VortexRing::new(p, conditions.vortex_ring, induced, Noise::stream(seed, Stream::VortexRing)));
        let room = (conditions.room_side > 0.0)
            .then(|| Room::new(conditions.room_side, weight, Noise::stream(seed, Stream::Room)));
        let Conditions { ceiling_effect: ceiling, wall_effect: wall, .. } = *conditions;
        let is_there = ceiling > 0.0 || wall > 0.0 || vortex_ring.is_some() || room.is_some();
        is_there.then_some(Self { radius: p.rotor_radius, area, induced, ceiling, wall, vortex_ring, room })
    }

    /// Factor on the thrust of rotors under the scene's ceiling.
    pub fn lift(&self, motion: &Motion, scene: &Scene) -> f64 {
        match scene.ceiling {
            Some(height) if self.ceiling > 0.0 => {
                1.0 + self.ceiling * (near::under_ceiling((height + motion.position.z) / self.radius) - 1.0)
            }
            _ => 1.0,
        }
    }

    /// Velocity of what comes back from the walls now, world, m/s.
    pub fn returning(&self) -> Vector3<f64> {
        self.room.as_ref().map_or_else(Vector3::zeros, Room::velocity)
    }

    /// The same after one step. `share`: rotor speed in units of a hover's.
    pub fn wind(&mut self, share: f64) -> Vector3<f64> {
        self.room.as_mut().map_or_else(Vector3::zeros, |room| room.step(DT, share))
    }

    /// One step: `air` is the velocity through the air, body, m/s.
    pub fn push(&mut self, motion: &Motion, scene: &Scene, air: &Vector3<f64>, share: f64) -> Push {
        let mut push = match &mut self.vortex_ring {
            Some(ring) => ring.step(DT, air, share),
            None => Push { force: Vector3::zeros(), torque: Vector3::zeros() },
        };
        if let Some(wall) = scene.wall.filter(|_| self.wall > 0.0) {
            let flow = self.area * self.induced * share;
            let force = self.wall * near::beside_wall(-wall.depth(&motion.position), flow, self.radius);
            let toward = Vector3::new(wall.ahead[0], wall.ahead[1], 0.0) * force;
            push.force += motion.attitude.inverse_transform_vector(&toward);
        }
        push
    }
}
