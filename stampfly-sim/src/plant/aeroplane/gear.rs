//! Ground contact of an aeroplane on a flat ground at z = 0: three wheels, and nose, tail, fin and
//! wing tips.
//!
//! Each point has a spring and a damper along the vertical, and springs with Coulomb's limit along
//! and across its direction. For a wheel the limit along is its rolling friction (or brake) and the
//! limit across that of its tyre, so a standing wheel does not creep, and a rolling one does not
//! skid. A rolling tyre relaxes its lateral deflection over a relaxation length (Pacejka, Tyre and
//! Vehicle Dynamics), which gives its cornering stiffness. The propeller is a disc that stops as
//! soon as any part of it is below the ground. The ground does not pull.

use super::AeroplaneParameters;
use crate::plant::DT;
use nalgebra::{UnitQuaternion, Vector3};

/// Contact points: nose wheel, right and left main wheel, tail skid, then propeller tip, spinner,
/// fin, right and left wing tip.
const POINTS: usize = 9;
const WHEELS: usize = 3;
const SKIDS: usize = 4;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Point {
    place: Vector3<f64>,
    stiffness: f64,
    damping: f64,
}

/// Contact state of undercarriage and airframe.
#[derive(Clone, Debug, PartialEq)]
pub struct Gear {
    points: [Point; POINTS],
    /// Horizontal deflection of each point along and across, m; `None` in the air.
    deflections: [Option<[f64; 2]>; POINTS],
    /// Distance of the farthest point from the origin.
    reach: f64,
    rolling: f64,
    side: f64,
    brake: f64,
    relaxation: f64,
    friction: f64,
    strikes: u64,
    scrapes: u64,
    /// Centre and radius of the propeller disc.
    hub: Vector3<f64>,
    radius: f64,
}

impl Gear {
    pub(super) fn new(p: &AeroplaneParameters) -> Self {
        // The wheels are lengthened by their compression, so that it stands level with its origin
        // at `gear_height` under its weight.
        let weight = p.mass * p.gravity;
        let on_nose = weight * p.gear_main / (p.gear_main + p.gear_nose);
        let wheel = |x: f64, y: f64, load: f64| Point {
            place: Vector3::new(x, y, p.gear_height + load / p.gear_stiffness),
            stiffness: p.gear_stiffness,
            damping: p.gear_damping,
        };
        let hard = |x: f64, y: f64, z: f64| Point {
            place: Vector3::new(x, y, z),
            stiffness: p.body_stiffness,
            damping: p.body_damping,
        };
        let (half_track, half_span) = (0.5 * p.gear_track, 0.5 * p.wing_span);
        let points = [
            wheel(p.gear_nose, 0.0, on_nose),
            wheel(-p.gear_main, half_track, 0.5 * (weight - on_nose)),
            wheel(-p.gear_main, -half_track, 0.5 * (weight - on_nose)),
            hard(-p.tail_behind, 0.0, p.tail_below),
            hard(p.propeller_ahead, 0.0, p.propeller_below + 0.5 * p.propeller_diameter),
            hard(p.propeller_ahead, 0.0, p.propeller_below),
            hard(-p.tail_behind, 0.0, -p.fin_above),
            hard(0.0, half_span, -p.tips_above),
            hard(0.0, -half_span, -p.tips_above),
        ];
        Self {
            points,
            deflections: [None; POINTS],
            reach: points.iter().map(|point| point.place.norm()).fold(0.0, f64::max),
            rolling: p.wheel_rolling,
            side: p.wheel_side,
            brake: p.wheel_brake,
            relaxation: p.wheel_relaxation,
            friction: p.body_friction,
            strikes: 0,
            scrapes: 0,
            hub: Vector3::new(p.propeller_ahead, 0.0, p.propeller_below),
            radius: 0.5 * p.propeller_diameter,
        }
    }

    /// True while any point touches the ground.
    #[must_use]
    pub fn contact(&self) -> bool {
        self.deflections.iter().any(Option::is_some)
    }

    /// Which wheels touch the ground: nose, right, left.
    #[must_use]
    pub fn wheels(&self) -> [bool; 3] {
        core::array::from_fn(|wheel| self.deflections[wheel].is_some())
    }

    /// Number of steps in which a part other than a wheel touched the ground: propeller, spinner,
    /// tail, fin, wing tip.
    #[must_use]
    pub fn strikes(&self) -> u64 {
        self.strikes
    }

    /// Number of steps in which a part that does not carry the aeroplane touched the ground: as
    /// [`strikes`](Self::strikes), without the tail, which has a skid.
    #[must_use]
    pub fn scrapes(&self) -> u64 {
        self.scrapes
    }

    /// True while the propeller touches the ground.
    pub(super) fn holds_propeller(&self, position: &Vector3<f64>, attitude: &UnitQuaternion<f64>) -> bool {
        if -position.z > self.reach {
            return false;
        }
        // Height difference from the hub to the lowest point of the disc, which is perpendicular to
        // body x.
        let nose = (attitude * Vector3::x()).z;
        let lowest = self.radius * (1.0 - nose * nose).max(0.0).sqrt();
        position.z + (attitude * self.hub).z + lowest > 0.0
    }

    /// Force (world) and torque (body) of the ground, with the nose wheel turned by `steering`,
    /// rad, positive right, and the share `brake`, 0 to 1, of the main wheels' brakes.
    pub(super) fn push(
        &mut self,
        position: &Vector3<f64>,
        velocity: &Vector3<f64>,
        attitude: &UnitQuaternion<f64>,
        rate: &Vector3<f64>,
        steering: f64,
        brake: f64,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let (mut force, mut torque) = (Vector3::zeros(), Vector3::zeros());
        if -position.z > self.reach {
            self.deflections = [None; POINTS];
            return (force, torque);
        }
        let [mut strikes, mut scrapes] = [false; 2];
        for (index, (point, deflection)) in self.points.iter().zip(&mut self.deflections).enumerate() {
            let arm = attitude * point.place;
            let depth = position.z + arm.z;
            if depth <= 0.0 {
                *deflection = None;
                continue;
            }
            let is_wheel = index < WHEELS;
            strikes |= !is_wheel;
            scrapes |= index >= SKIDS;
            // Velocity of the contact point.
            let speed = velocity + attitude * rate.cross(&point.place);
            let normal = (point.stiffness * depth + point.damping * speed.z).max(0.0);
            // Only the nose wheel is steered.
            let turned = if index == 0 { libm::sincos(steering) } else { (0.0, 1.0) };
            // Skids have no rolling direction; the axes of the world serve for their friction.
            let ahead = if is_wheel { ahead(attitude, turned) } else { [1.0, 0.0] };
            let limits = match index {
                0 => [self.rolling, self.side],
                1 | 2 => [self.rolling + self.brake * brake, self.side],
                _ => [self.friction; 2],
            };
            let along = speed.x * ahead[0] + speed.y * ahead[1];
            let across = speed.y * ahead[0] - speed.x * ahead[1];
            let bent = deflection.get_or_insert([0.0; 2]);
            if is_wheel {
                // Relaxation of the tyre's lateral deflection over the distance rolled in this
                // step.
                bent[1] -= bent[1] * (along.abs() * DT / self.relaxation).min(1.0);
            }
            let mut held = [0.0; 2];
            for (axis, speed) in [along, across].into_iter().enumerate() {
                bent[axis] += speed * DT;
                let wanted = -point.stiffness * bent[axis] - point.damping * speed;
                held[axis] = wanted.clamp(-limits[axis] * normal, limits[axis] * normal);
                if held[axis] != wanted {
                    // Sliding: the spring keeps the deflection that friction can hold.
                    bent[axis] = -held[axis] / point.stiffness;
                }
            }
            let here =
                Vector3::new(held[0] * ahead[0] - held[1] * ahead[1], held[0] * ahead[1] + held[1] * ahead[0], -normal);
            force += here;
            torque += point.place.cross(&attitude.inverse_transform_vector(&here));
        }
        self.strikes += u64::from(strikes);
        self.scrapes += u64::from(scrapes);
        (force, torque)
    }
}

/// Rolling direction of a wheel, world north and east: body x turned about body z by an angle with
/// the given sine and cosine.
fn ahead(attitude: &UnitQuaternion<f64>, (sin, cos): (f64, f64)) -> [f64; 2] {
    let axis = attitude * Vector3::new(cos, sin, 0.0);
    let length = (axis.x * axis.x + axis.y * axis.y).sqrt();
    // Undefined with body x vertical; any direction will do.
    if length > 1e-3 { [axis.x / length, axis.y / length] } else { [1.0, 0.0] }
}
