//! A flat ground at z = 0, the three wheels that roll on it, and what hits it in a crash: nose, tail, fin and wing tips.
//!
//! Each point is a spring and a damper along the vertical, and a spring with Coulomb's limit along
//! and across its way. A wheel's limits are its rolling friction (or its brake) along and its
//! tyre's across, so it stands still without creeping, rolls, and does not slide. The propeller is
//! a disc: where any of it is below the ground, it stops. On its way a tyre gives its side
//! deflection back, after a relaxation length (Pacejka, Tyre and Vehicle Dynamics), which makes its
//! cornering stiffness. The ground does not pull.

use super::AeroplaneParameters;
use crate::plant::DT;
use nalgebra::{UnitQuaternion, Vector3};

/// Points that can touch: nose wheel, right and left main wheel, tail skid, then propeller tip,
/// spinner, fin, right and left wing tip.
const POINTS: usize = 9;
const WHEELS: usize = 3;
const SKIDS: usize = 4;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Point {
    place: Vector3<f64>,
    stiffness: f64,
    damping: f64,
}

/// Undercarriage and ground as the aeroplane feels them.
#[derive(Clone, Debug, PartialEq)]
pub struct Gear {
    points: [Point; POINTS],
    /// Deflection of each point along and across, m; `None` in the air.
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
    /// Middle of the propeller's disc, and its radius.
    hub: Vector3<f64>,
    radius: f64,
}

impl Gear {
    pub(super) fn new(p: &AeroplaneParameters) -> Self {
        // Wheels are so long that it stands level, with its origin at `gear_height`, once the springs carry the weight.
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

    /// Does anything touch the ground?
    #[must_use]
    pub fn contact(&self) -> bool {
        self.deflections.iter().any(Option::is_some)
    }

    /// Which wheels touch the ground: nose, right, left.
    #[must_use]
    pub fn wheels(&self) -> [bool; 3] {
        core::array::from_fn(|wheel| self.deflections[wheel].is_some())
    }

    /// In how many steps something has touched the ground that is no wheel: the propeller, the
    /// spinner, the tail, the fin, a wing tip.
    #[must_use]
    pub fn strikes(&self) -> u64 {
        self.strikes
    }

    /// In how many steps something has touched the ground that does not carry an aeroplane: as
    /// [`strikes`](Self::strikes), but for the tail, which has a skid.
    #[must_use]
    pub fn scrapes(&self) -> u64 {
        self.scrapes
    }

    /// Does the propeller touch the ground?
    pub(super) fn holds_propeller(&self, position: &Vector3<f64>, attitude: &UnitQuaternion<f64>) -> bool {
        if -position.z > self.reach {
            return false;
        }
        // From the hub to the lowest place of the disc, which stands across body x.
        let nose = (attitude * Vector3::x()).z;
        let lowest = self.radius * (1.0 - nose * nose).max(0.0).sqrt();
        position.z + (attitude * self.hub).z + lowest > 0.0
    }

    /// Force (world) and torque (body) of the ground, with the nose wheel turned by `steering` (rad, right is positive) and the main
    /// wheels braked by a share.
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
            let speed = velocity + attitude * rate.cross(&point.place);
            let normal = (point.stiffness * depth + point.damping * speed.z).max(0.0);
            let turned = if index == 0 { libm::sincos(steering) } else { (0.0, 1.0) };
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
                bent[1] -= bent[1] * (along.abs() * DT / self.relaxation).min(1.0);
            }
            let mut held = [0.0; 2];
            for (axis, speed) in [along, across].into_iter().enumerate() {
                bent[axis] += speed * DT;
                let wanted = -point.stiffness * bent[axis] - point.damping * speed;
                held[axis] = wanted.clamp(-limits[axis] * normal, limits[axis] * normal);
                if held[axis] != wanted {
                    // It slides: the spring keeps just what friction allows.
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

/// Where a wheel rolls, world north and east: body x turned about body z by an angle whose sine and cosine are given.
fn ahead(attitude: &UnitQuaternion<f64>, (sin, cos): (f64, f64)) -> [f64; 2] {
    let axis = attitude * Vector3::new(cos, sin, 0.0);
    let length = (axis.x * axis.x + axis.y * axis.y).sqrt();
    // A wheel of an aeroplane that stands on its nose rolls nowhere in particular.
    if length > 1e-3 { [axis.x / length, axis.y / length] } else { [1.0, 0.0] }
}
