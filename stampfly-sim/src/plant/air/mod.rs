//! Aerodynamic interaction of rotors with their surroundings, beyond drag and ground effect.
//!
//! | part | effect |
//! |---|---|
//! | [`near`] | ceilings and walls attract the rotors |
//! | [`vortex_ring`] | loss of thrust when sinking into the own wake |
//! | [`room`] | the wake recirculates in a small room |
//!
//! The effects scale with the induced velocity in hover, `v = √(T / 2ρA)` (momentum theory): 7.3
//! m/s for a StampFly, whose discs are small for its weight, and half of that for most vehicles of
//! its kind. Each effect is off unless the [conditions](Conditions) enable it.

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

/// Effects enabled for one vehicle.
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

/// Force and torque on the body, in the body frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Push {
    pub force: Vector3<f64>,
    pub torque: Vector3<f64>,
}

impl Air {
    /// `None` if the conditions enable no effect.
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

    /// Factor on the thrust due to the scene's ceiling.
    pub fn lift(&self, motion: &Motion, scene: &Scene) -> f64 {
        match scene.ceiling {
            Some(height) if self.ceiling > 0.0 => {
                1.0 + self.ceiling * (near::under_ceiling((height + motion.position.z) / self.radius) - 1.0)
            }
            _ => 1.0,
        }
    }

    /// Present velocity of the recirculating air, world, m/s.
    pub fn returning(&self) -> Vector3<f64> {
        self.room.as_ref().map_or_else(Vector3::zeros, Room::velocity)
    }

    /// Advances the recirculating air by one step and returns its velocity. `share` is the rotor
    /// speed relative to hover.
    pub fn wind(&mut self, share: f64) -> Vector3<f64> {
        self.room.as_mut().map_or_else(Vector3::zeros, |room| room.step(DT, share))
    }

    /// Force and torque of vortex ring and wall in one step. `air` is the velocity through the air,
    /// body, m/s.
    pub fn push(&mut self, motion: &Motion, scene: &Scene, air: &Vector3<f64>, share: f64) -> Push {
        let mut push = match &mut self.vortex_ring {
            Some(ring) => ring.step(DT, air, share),
            None => Push { force: Vector3::zeros(), torque: Vector3::zeros() },
        };
        if let Some(wall) = scene.wall.filter(|_| self.wall > 0.0) {
            // Volume flow through all discs; the induced velocity is proportional to rotor speed.
            let flow = self.area * self.induced * share;
            let force = self.wall * near::beside_wall(-wall.depth(&motion.position), flow, self.radius);
            let toward = Vector3::new(wall.ahead[0], wall.ahead[1], 0.0) * force;
            push.force += motion.attitude.inverse_transform_vector(&toward);
        }
        push
    }
}
