//! Contact with the floor: four feet, four corners, and the propellers.
//!
//! The floor is at world z = 0 or where the [scene](super::Scene) places it. Each contact point has
//! a spring and a damper along the vertical, and along the horizontal a spring to its anchor,
//! limited by Coulomb friction, so a standing vehicle does not creep. The floor does not pull.
//!
//! Unguarded propellers can touch the floor, too. Contact stops them; it carries no load.

use super::{DT, PlantParameters, ROTORS, Scene};
use nalgebra::{UnitQuaternion, Vector3};

/// Signs of feet and corners (x, y), multiplied by their offset.
const SIDES: [(f64, f64); 4] = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];

/// Contact points: feet first, then corners.
const POINTS: usize = 8;
const FEET: usize = 4;

/// Contact state of one vehicle.
#[derive(Clone, Debug, PartialEq)]
pub struct Ground {
    /// Horizontal anchor of each point, world north and east; `None` in the air.
    anchors: [Option<(f64, f64)>; POINTS],
    points: [Vector3<f64>; POINTS],
    /// Steps in which a ceiling or a wall pushed.
    strikes: u64,
    /// Steps in which a corner or a propeller touched the floor.
    scrapes: u64,
    /// Propeller hubs and radius. A radius of 0 disables propeller contact.
    hubs: [Vector3<f64>; ROTORS],
    radius: f64,
    /// Distance of the farthest point of a propeller from the origin.
    span: f64,
    /// Distance of the farthest contact point from the origin.
    reach: f64,
    stiffness: f64,
    damping: f64,
    friction: f64,
    effect_gain: f64,
    effect_height: f64,
}

impl Ground {
    pub(crate) fn new(p: &PlantParameters) -> Self {
        // The feet are lengthened by their compression, so that the origin stands at
        // `ground_height` under the vehicle's weight.
        let sink = p.mass * p.gravity / (4.0 * p.foot_stiffness);
        let points: [Vector3<f64>; POINTS] = core::array::from_fn(|i| {
            let (x, y) = SIDES[i % 4];
            let (offset, down) =
                if i < FEET { (p.foot_offset, p.ground_height + sink) } else { (p.corner_offset, -p.corner_height) };
            Vector3::new(x * offset - p.centre_x, y * offset - p.centre_y, down)
        });
        let hubs = SIDES.map(|(x, y)| {
            Vector3::new(x * p.rotor_offset - p.centre_x, y * p.rotor_offset - p.centre_y, -p.corner_height)
        });
        Self {
            anchors: [None; POINTS],
            strikes: 0,
            scrapes: 0,
            hubs,
            radius: p.propeller_radius,
            span: hubs.iter().map(Vector3::norm).fold(0.0, f64::max) + p.propeller_radius,
            points,
            reach: points.iter().map(Vector3::norm).fold(0.0, f64::max),
            stiffness: p.foot_stiffness,
            damping: p.foot_damping,
            friction: p.foot_friction,
            effect_gain: p.ground_effect_gain,
            effect_height: p.ground_effect_height,
        }
    }

    /// True while a foot or a corner touches the floor.
    #[must_use]
    pub fn contact(&self) -> bool {
        self.anchors.iter().any(Option::is_some)
    }

    /// Number of steps in which a ceiling or a wall has pushed.
    #[must_use]
    pub fn strikes(&self) -> u64 {
        self.strikes
    }

    /// Number of steps in which a corner or a propeller has touched the floor.
    #[must_use]
    pub fn scrapes(&self) -> u64 {
        self.scrapes
    }

    /// Propellers that touch the floor, in motor order. Counts the scrapes.
    pub(crate) fn held(
        &mut self,
        position: &Vector3<f64>,
        attitude: &UnitQuaternion<f64>,
        scene: &Scene,
    ) -> [bool; ROTORS] {
        let corners = self.anchors.iter().skip(FEET).any(Option::is_some);
        let is_high = scene.slope == [0.0; 2] && -position.z - scene.highest() > self.span;
        // Shortcut for the usual case in the air.
        let is_free = self.radius <= 0.0 || is_high;
        if is_free {
            self.scrapes += u64::from(corners);
            return [false; ROTORS];
        }
        let axis = attitude * Vector3::z();
        // Vector from the hub to the lowest point of the tilted disc.
        let down = Vector3::z() - axis * axis.z;
        let length = down.norm();
        let lowest = if length > 1e-6 { down * (self.radius / length) } else { Vector3::zeros() };
        let held = self.hubs.map(|hub| {
            let place = position + attitude * hub + lowest;
            place.z > scene.floor(&place)
        });
        self.scrapes += u64::from(corners || held.contains(&true));
        held
    }

    /// Ground effect: factor on the thrust of rotors at `height`, m, above the floor.
    #[must_use]
    pub(crate) fn lift(&self, height: f64) -> f64 {
        if height > 8.0 * self.effect_height {
            return 1.0;
        }
        1.0 + self.effect_gain * libm::exp(-height.max(0.0) / self.effect_height)
    }

    /// Force (world) and torque (body) of floor, ceiling and walls on the vehicle.
    pub(crate) fn push(
        &mut self,
        position: &Vector3<f64>,
        velocity: &Vector3<f64>,
        attitude: &UnitQuaternion<f64>,
        rate: &Vector3<f64>,
        scene: &Scene,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let (mut force, mut torque) = (Vector3::zeros(), Vector3::zeros());
        if scene.may_strike(position, self.reach) {
            let mut strikes = false;
            for point in &self.points {
                let place = position + attitude * point;
                let speed = velocity + attitude * rate.cross(point);
                for (depth, out) in scene.inside(&place) {
                    strikes = true;
                    // Stiffness and damping as for the floor, without friction.
                    let here = out * (self.stiffness * depth - self.damping * speed.dot(&out)).max(0.0);
                    force += here;
                    torque += point.cross(&attitude.inverse_transform_vector(&here));
                }
            }
            self.strikes += u64::from(strikes);
        }
        if scene.slope == [0.0; 2] && -position.z - scene.highest() > self.reach {
            self.anchors = [None; POINTS];
            return (force, torque);
        }
        let ([floor_north, floor_east], out) = (scene.floor_velocity, scene.normal());
        for (point, anchor) in self.points.iter().zip(&mut self.anchors) {
            let place = position + attitude * point;
            let depth = place.z - scene.floor(&place);
            // Losing contact also forgets the anchor: the next contact sticks where it touches.
            if depth <= 0.0 {
                *anchor = None;
                continue;
            }
            let speed = velocity + attitude * rate.cross(point) - Vector3::new(floor_north, floor_east, 0.0);
            let normal = (self.stiffness * (depth * -out.z) - self.damping * speed.dot(&out)).max(0.0);
            // On a moving floor the anchor moves along.
            let stuck = anchor.get_or_insert((place.x, place.y));
            *stuck = (stuck.0 + floor_north * DT, stuck.1 + floor_east * DT);
            let (mut x, mut y) = (
                self.stiffness * (stuck.0 - place.x) - self.damping * speed.x,
                self.stiffness * (stuck.1 - place.y) - self.damping * speed.y,
            );
            let (wanted, limit) = ((x * x + y * y).sqrt(), self.friction * normal);
            if wanted > limit {
                // Sliding: the anchor follows so that its spring force equals the friction limit.
                (x, y) = (x * limit / wanted, y * limit / wanted);
                *stuck = (place.x + x / self.stiffness, place.y + y / self.stiffness);
            }
            // Friction acts along the inclined floor, the normal force out of it.
            let here = Vector3::new(x, y, -scene.slope[0] * x - scene.slope[1] * y) + out * normal;
            force += here;
            torque += point.cross(&attitude.inverse_transform_vector(&here));
        }
        (force, torque)
    }
}
