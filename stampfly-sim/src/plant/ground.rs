//! A flat floor at world z = 0, or where the [scene](super::Scene) has it, the four feet that stand on it and the four corners that hit it in a crash.
//!
//! Each point is a spring and a damper along the vertical, and a spring to the place where it stuck with Coulomb's
//! limit along the horizontal: a vehicle that stands, stands still instead of creeping. The floor does not pull.

use super::{DT, PlantParameters, Scene};
use nalgebra::{UnitQuaternion, Vector3};

/// Feet and corners, in units of their offset (x, y).
const SIDES: [(f64, f64); 4] = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];

/// Points that can touch: feet first, then corners.
const POINTS: usize = 8;

/// The floor as the vehicle feels it.
#[derive(Clone, Debug, PartialEq)]
pub struct Ground {
    /// Where each point stuck to the floor, world north and east; `None` in the air.
    anchors: [Option<(f64, f64)>; POINTS],
    points: [Vector3<f64>; POINTS],
    /// Steps in which a ceiling or a wall pushed.
    strikes: u64,
    /// Distance of the farthest point from the origin.
    reach: f64,
    stiffness: f64,
    damping: f64,
    friction: f64,
    effect_gain: f64,
    effect_height: f64,
}

impl Ground {
    pub(crate) fn new(p: &PlantParameters) -> Self {
        // The feet are so long that the origin stands at `ground_height` once the springs carry the weight.
        let sink = p.mass * p.gravity / (4.0 * p.foot_stiffness);
        let points: [Vector3<f64>; POINTS] = core::array::from_fn(|i| {
            let (x, y) = SIDES[i % 4];
            let (offset, down) =
                if i < 4 { (p.foot_offset, p.ground_height + sink) } else { (p.corner_offset, -p.corner_height) };
            Vector3::new(x * offset, y * offset, down)
        });
        Self {
            anchors: [None; POINTS],
            strikes: 0,
            points,
            reach: points.iter().map(Vector3::norm).fold(0.0, f64::max),
            stiffness: p.foot_stiffness,
            damping: p.foot_damping,
            friction: p.foot_friction,
            effect_gain: p.ground_effect_gain,
            effect_height: p.ground_effect_height,
        }
    }

    /// Does anything touch the floor?
    #[must_use]
    pub fn contact(&self) -> bool {
        self.anchors.iter().any(Option::is_some)
    }

    /// In how many steps a ceiling or a wall has pushed.
    #[must_use]
    pub fn strikes(&self) -> u64 {
        self.strikes
    }

    /// Factor on the thrust of rotors at `height` metres above the floor.
    #[must_use]
    pub(crate) fn lift(&self, height: f64) -> f64 {
        if height > 8.0 * self.effect_height {
            return 1.0;
        }
        1.0 + self.effect_gain * libm::exp(-height.max(0.0) / self.effect_height)
    }

    /// Force (world) and torque (body) of the floor on the vehicle.
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
                    // As hard as the floor, without its friction.
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
            if depth <= 0.0 {
                *anchor = None;
                continue;
            }
            let speed = velocity + attitude * rate.cross(point) - Vector3::new(floor_north, floor_east, 0.0);
            let normal = (self.stiffness * (depth * -out.z) - self.damping * speed.dot(&out)).max(0.0);
            let stuck = anchor.get_or_insert((place.x, place.y));
            *stuck = (stuck.0 + floor_north * DT, stuck.1 + floor_east * DT);
            let (mut x, mut y) = (
                self.stiffness * (stuck.0 - place.x) - self.damping * speed.x,
                self.stiffness * (stuck.1 - place.y) - self.damping * speed.y,
            );
            let (wanted, limit) = ((x * x + y * y).sqrt(), self.friction * normal);
            if wanted > limit {
                // Slide: the anchor follows so that its spring holds just what friction allows.
                (x, y) = (x * limit / wanted, y * limit / wanted);
                *stuck = (place.x + x / self.stiffness, place.y + y / self.stiffness);
            }
            // Along the floor, and out of it.
            let here = Vector3::new(x, y, -scene.slope[0] * x - scene.slope[1] * y) + out * normal;
            force += here;
            torque += point.cross(&attitude.inverse_transform_vector(&here));
        }
        (force, torque)
    }
}
