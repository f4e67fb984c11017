//! Obstacles around a quadrotor and the shape of the floor: slope, edge, ceiling, wall, holding
//! hand.
//!
//! Empty by default. Conditions and faults change the scene between two steps, relative to the
//! vehicle's position. Range finder and flow sensor see edges and the motion of the floor. No
//! sensor sees walls, ceilings or hands, because the vehicle's range finder points down.

use super::Motion;
use crate::conditions::Conditions;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// A vertical half space: everything beyond a line on the floor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beyond {
    /// A point of the line, world north and east, m.
    pub point: [f64; 2],
    /// Unit vector into the half space, world north and east.
    pub ahead: [f64; 2],
}

impl Beyond {
    /// The half space that begins `distance` metres ahead in the direction of travel, or ahead of
    /// the nose below 0.1 m/s.
    #[must_use]
    pub fn ahead_of(motion: &Motion, distance: f64) -> Self {
        let nose = motion.attitude * Vector3::x();
        // Below this speed the direction of travel is undefined.
        let way = if motion.velocity.xy().norm() > 0.1 { motion.velocity } else { nose };
        let length = way.xy().norm().max(1e-6);
        let ahead = [way.x / length, way.y / length];
        Self { point: [motion.position.x + distance * ahead[0], motion.position.y + distance * ahead[1]], ahead }
    }

    /// Depth of a point inside the half space, m; negative outside.
    pub(super) fn depth(&self, place: &Vector3<f64>) -> f64 {
        (place.x - self.point[0]) * self.ahead[0] + (place.y - self.point[1]) * self.ahead[1]
    }
}

/// A hand that holds the vehicle at a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hand {
    /// World NED, m.
    pub position: Vector3<f64>,
    /// Body FRD → world NED.
    pub attitude: UnitQuaternion<f64>,
}

impl Hand {
    /// A hand at this position, world NED, m, with this roll, pitch and yaw, rad.
    #[must_use]
    pub fn new(position: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Self {
        // Not nalgebra's constructor, whose sine depends on the platform.
        let about = |axis: Vector3<f64>, angle: f64| {
            let (sin, cos) = libm::sincos(0.5 * angle);
            UnitQuaternion::new_normalize(Quaternion::from_parts(cos, axis * sin))
        };
        let attitude = about(Vector3::z(), yaw) * about(Vector3::y(), pitch) * about(Vector3::x(), roll);
        Self { position: position.into(), attitude }
    }

    /// Pose on the way from this hand to `there`, at the share `share`, 0 to 1, with smooth start
    /// and end.
    #[must_use]
    pub fn toward(&self, there: &Self, share: f64) -> Self {
        let share = share.clamp(0.0, 1.0);
        // Smoothstep: zero velocity at both ends.
        let share = share * share * (3.0 - 2.0 * share);
        let turn = (self.attitude.inverse() * there.attitude).scaled_axis() * share;
        let angle = turn.norm();
        let (sin, cos) = libm::sincos(0.5 * angle);
        let part = if angle > 1e-9 { turn * (sin / angle) } else { turn * 0.5 };
        let turned = UnitQuaternion::new_normalize(Quaternion::from_parts(cos, part));
        let position = self.position + (there.position - self.position) * share;
        Self { position, attitude: self.attitude * turned }
    }
}

/// Spring, N/m, and damper, N·s/m, of an arm: 60 N/m give way by some millimetres under tens of
/// grams.
const ARM: [f64; 2] = [60.0, 1.5];
/// Spring, N·m/rad, and damper, N·m·s/rad, of the wrist.
const WRIST: [f64; 2] = [0.02, 3.0e-4];

/// The surroundings. The default is a flat floor at rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Half space in which the floor is lower (higher if negative), and the drop, m.
    pub edge: Option<(Beyond, f64)>,
    /// Rise of the floor towards north and east, m/m. Changing it under a standing vehicle causes a
    /// jolt.
    pub slope: [f64; 2],
    /// Point at which the slope crosses the level floor, world north and east, m.
    pub pivot: [f64; 2],
    /// Velocity of the floor, world north and east, m/s.
    pub floor_velocity: [f64; 2],
    /// Height of a ceiling, m.
    pub ceiling: Option<f64>,
    /// A wall.
    pub wall: Option<Beyond>,
    /// A hand.
    pub hand: Option<Hand>,
}

/// Depth below the upper of two floors from which a point belongs to the lower one, m: more than
/// any contact compresses the floor.
const OVERHANG: f64 = 0.05;

impl Scene {
    /// A flat floor at rest, as by default.
    pub const LEVEL: Self = Self {
        edge: None,
        slope: [0.0; 2],
        pivot: [0.0; 2],
        floor_velocity: [0.0; 2],
        ceiling: None,
        wall: None,
        hand: None,
    };

    /// The scene given by these conditions: floor step, moving floor, ceiling.
    #[must_use]
    pub fn under(conditions: &Conditions) -> Self {
        let Conditions { ceiling, floor_step: step, floor_step_distance: distance, .. } = *conditions;
        let (east, north) = libm::sincos(conditions.floor_step_bearing);
        let ahead = [north, east];
        Self {
            edge: (step != 0.0).then(|| (Beyond { point: ahead.map(|part| part * distance), ahead }, -step)),
            floor_velocity: [conditions.floor_north, conditions.floor_east],
            ceiling: (ceiling > 0.0).then_some(ceiling),
            ..Self::LEVEL
        }
    }

    /// z of the floor at a position, world NED, m.
    #[must_use]
    pub fn floor(&self, place: &Vector3<f64>) -> f64 {
        let level = match &self.edge {
            Some((beyond, drop)) => {
                let inside = beyond.depth(place);
                let (here, there) = if inside > 0.0 { (*drop, 0.0) } else { (0.0, *drop) };
                // A point below the upper floor must not be thrown up through it. A point deeper
                // below that floor than behind its face is treated as touching the face, which
                // pushes it out sideways.
                if place.z > here + OVERHANG.min(inside.abs()) { here.max(there) } else { here }
            }
            None => 0.0,
        };
        level - self.slope[0] * (place.x - self.pivot[0]) - self.slope[1] * (place.y - self.pivot[1])
    }

    /// Distance from a position to the floor along a unit vector that points down, m.
    #[must_use]
    pub fn distance(&self, place: &Vector3<f64>, beam: &Vector3<f64>) -> f64 {
        // On a slope an edge counts only directly below the sensor; the beam meets the plane of
        // that floor.
        if self.slope != [0.0; 2] {
            let steepness = beam.z + self.slope[0] * beam.x + self.slope[1] * beam.y;
            return (self.floor(place) - place.z) / steepness.max(1e-3);
        }
        let meets = |level: f64| (level - place.z) / beam.z;
        let Some((beyond, drop)) = &self.edge else { return meets(0.0) };
        // z points down, so the upper floor has the smaller z.
        let (upper, lower) = (drop.min(0.0), drop.max(0.0));
        // A beam that passes over an edge meets the lower floor, and so does a beam that starts
        // below the upper floor.
        let is_beyond = beyond.depth(&(place + beam * meets(upper))) > 0.0;
        let on_upper = is_beyond == (*drop < 0.0) && place.z <= upper + OVERHANG;
        meets(if on_upper { upper } else { lower })
    }

    /// Upward normal of the floor, world NED.
    pub(super) fn normal(&self) -> Vector3<f64> {
        let [north, east] = self.slope;
        Vector3::new(-north, -east, -1.0) / (1.0 + north * north + east * east).sqrt()
    }

    /// Penetration depths of a point into ceiling, wall and the face of an edge, each with the
    /// outward direction.
    pub(super) fn inside(&self, place: &Vector3<f64>) -> impl Iterator<Item = (f64, Vector3<f64>)> {
        let ceiling = self.ceiling.map(|height| (-place.z - height, Vector3::new(0.0, 0.0, 1.0)));
        let wall = self.wall.map(|wall| (wall.depth(place), Vector3::new(-wall.ahead[0], -wall.ahead[1], 0.0)));
        let face = self.edge.and_then(|(beyond, drop)| {
            // The face of the upper floor points towards the lower one.
            let (inside, out) = if drop > 0.0 { (-beyond.depth(place), 1.0) } else { (beyond.depth(place), -1.0) };
            let below = place.z - drop.min(0.0);
            // A point nearer to the top than to the face is carried by the upper floor instead of
            // being pushed by the face.
            let strikes = below > inside && self.floor(place) > drop.min(0.0);
            strikes.then_some((inside, Vector3::new(out * beyond.ahead[0], out * beyond.ahead[1], 0.0)))
        });
        [ceiling, wall, face].into_iter().flatten().filter(|(depth, _)| *depth > 0.0)
    }

    /// Height of the highest floor without slope, m.
    pub(super) fn highest(&self) -> f64 {
        self.edge.map_or(0.0, |(_, drop)| (-drop).max(0.0))
    }

    /// True if a ceiling, a wall or a face can touch a vehicle here whose points are within `reach`
    /// of its origin.
    pub(super) fn may_strike(&self, place: &Vector3<f64>, reach: f64) -> bool {
        let (ceiling, wall) = (self.ceiling, self.wall);
        let under = ceiling.is_some_and(|height| -place.z + reach > height);
        let beside = wall.is_some_and(|wall| wall.depth(place) + reach > 0.0);
        // The face of an edge acts only together with a ceiling or a wall: recorded flights depend
        // on this.
        let face = self.edge.is_some() && (ceiling.is_some() || wall.is_some());
        under || beside || face
    }

    /// Force (world) and torque (body) of the hand.
    pub(super) fn hold(&self, motion: &Motion) -> (Vector3<f64>, Vector3<f64>) {
        let Some(hand) = &self.hand else { return (Vector3::zeros(), Vector3::zeros()) };
        let force = (hand.position - motion.position) * ARM[0] - motion.velocity * ARM[1];
        let turn = (motion.attitude.inverse() * hand.attitude).scaled_axis();
        (force, turn * WRIST[0] - motion.rate * WRIST[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{Plant, PlantParameters, Pose, WindConfig};

    fn plant(height: f64) -> Plant {
        let parameters = PlantParameters { manufacturing_spread: 0.0, ..PlantParameters::EXAMPLE };
        let pose = Pose { rotors: 0.0, ..Pose::hovering(height) };
        Plant::new(&parameters, &WindConfig::CALM, Some(&pose), 1)
    }

    /// Regression: a floor half a metre above the vehicle used to throw it up.
    #[test]
    fn what_drifts_back_under_an_edge_stays_below() {
        for (drop, upper) in [(0.7, Vector3::new(-0.01, 0.0, 0.0)), (-0.7, Vector3::new(0.01, 0.0, -0.7))] {
            let ahead = Beyond { point: [0.0, 0.0], ahead: [1.0, 0.0] };
            let scene = Scene { edge: Some((ahead, drop)), ..Scene::default() };
            assert_eq!(scene.floor(&upper), upper.z, "on the upper floor");
            let under = upper + Vector3::new(0.0, 0.0, 0.5);
            assert_eq!(scene.floor(&under), upper.z + 0.7, "under it");
        }
    }

    #[test]
    fn the_face_of_an_edge_pushes_out_and_its_top_carries() {
        let ahead = Beyond { point: [0.0, 0.0], ahead: [1.0, 0.0] };
        // The lower floor is ahead, then behind.
        for (drop, upper, out) in [(0.7, 0.0, 1.0), (-0.7, -0.7, -1.0)] {
            let scene = Scene { edge: Some((ahead, drop)), ..Scene::default() };
            let struck = Vector3::new(-0.01 * out, 0.0, upper + 0.03);
            assert_eq!(scene.floor(&struck), upper + 0.7, "no floor throws it up");
            let pushes: Vec<_> = scene.inside(&struck).collect();
            assert_eq!(pushes, [(0.01, Vector3::new(out, 0.0, 0.0))], "{drop} m");
            let foot = Vector3::new(-0.02 * out, 0.0, upper + 0.002);
            assert_eq!((scene.floor(&foot), scene.inside(&foot).count()), (upper, 0), "{drop} m: a foot");
        }
    }

    /// From a metre above the level floor, vertically and inclined by 0.5 to either side.
    #[test]
    fn a_beam_ends_on_the_first_floor_that_it_meets() {
        let lean = |x: f64| Vector3::new(x, 0.0, 1.0).normalize();
        for drop in [-0.5, -0.06, -0.02, 0.02, 0.7] {
            let beyond = Beyond { point: [0.0; 2], ahead: [1.0, 0.0] };
            let scene = Scene { edge: Some((beyond, drop)), ..Scene::LEVEL };
            let down = |x: f64, beam: Vector3<f64>| scene.distance(&Vector3::new(x, 0.0, -1.0), &beam) * beam.z;
            let [here, there] = [down(-2.0, lean(0.0)), down(2.0, lean(0.0))];
            assert!((here - 1.0).abs() < 1e-9 && (there - 1.0 - drop).abs() < 1e-9, "{drop} m: {here}, {there}");
            // Inclined beams that reach the height of the upper floor just beyond the edge and just
            // before it. The face of a step is not seen.
            let upper = 1.0 + drop.min(0.0);
            let [beyond, before] = [0.01, -0.01].map(|past| down(past - 0.5 * upper, lean(0.5)));
            assert!((beyond - 1.0 - drop).abs() < 1e-9 && (before - 1.0).abs() < 1e-9, "{drop} m: {beyond}, {before}");
        }
    }

    #[test]
    fn beyond_an_edge_it_falls_deeper() {
        let mut plant = plant(0.3);
        let beyond = Beyond { point: [-1.0, 0.0], ahead: [1.0, 0.0] };
        plant.scene_mut().edge = Some((beyond, 0.5));
        (0..3200).for_each(|_| plant.step());
        assert!((plant.motion().position.z - 0.5).abs() < 0.1 && plant.ground().contact(), "{:?}", plant.motion());
        assert_eq!(plant.scene().floor(&Vector3::new(-1.1, 0.0, 0.0)), 0.0);
    }

    #[test]
    fn a_hand_carries_and_turns() {
        let mut carried = plant(0.5);
        let from = Hand::new([0.0, 0.0, -0.5], [0.0; 3]);
        let to = Hand::new([0.2, 0.0, -1.0], [0.0, core::f64::consts::FRAC_PI_2, 0.0]);
        for step in 0..3200 {
            carried.scene_mut().hand = Some(from.toward(&to, f64::from(step) / 1600.0));
            carried.step();
        }
        let nose = carried.motion().attitude * Vector3::x();
        assert!(nose.z < -0.99 && (carried.motion().position - to.position).norm() < 0.02, "{:?}", carried.motion());
        assert_eq!((from.toward(&to, 0.0), from.toward(&from, 0.7)), (from, from));
    }

    #[test]
    fn a_hand_holds_and_a_ceiling_and_a_wall_stop() {
        let mut held = plant(1.0);
        let Motion { position, attitude, .. } = *held.motion();
        held.scene_mut().hand = Some(Hand { position, attitude });
        (0..1600).for_each(|_| held.step());
        assert!((held.motion().position.z + 1.0).abs() < 0.02, "{:?}", held.motion());

        let mut under = plant(0.5);
        under.scene_mut().ceiling = Some(0.8);
        under.set_duty([1.0; 4]);
        let highest = (0..800).map(|_| {
            under.step();
            -under.motion().position.z
        });
        assert!(highest.fold(0.0, f64::max) < 0.85);

        let parameters = PlantParameters { manufacturing_spread: 0.0, ..PlantParameters::EXAMPLE };
        let pose = Pose { velocity: Vector3::new(1.0, 0.0, 0.0), ..Pose::hovering(2.0) };
        let mut flies = Plant::new(&parameters, &WindConfig::CALM, Some(&pose), 1);
        let wall = Beyond::ahead_of(flies.motion(), 0.3);
        flies.scene_mut().wall = Some(wall);
        (0..960).for_each(|_| flies.step());
        assert!(flies.motion().position.x < 0.35, "{:?}", flies.motion());
    }

    #[test]
    fn on_a_slope_it_stands_tilted_and_slides_where_it_is_too_steep() {
        let landed = |rise: f64| {
            let mut plant = plant(0.1);
            plant.scene_mut().slope = [rise, 0.0];
            (0..4800).for_each(|_| plant.step());
            *plant.motion()
        };
        let motion = landed(0.2);
        let nose = motion.attitude * Vector3::x();
        assert!((-nose.z - 0.2).abs() < 0.03 && motion.velocity.norm() < 0.02, "{motion:?}");
        // Friction is 0.6.
        assert!(landed(0.9).velocity.x < -0.5);
        let scene = Scene { slope: [0.2, 0.0], ..Scene::default() };
        let down = Vector3::new(0.0, 0.0, 1.0);
        assert!((scene.distance(&Vector3::new(1.0, 0.0, -1.0), &down) - 0.8).abs() < 1e-9);
        let beam = Vector3::new(0.2, 0.0, 1.0).normalize();
        let (place, far) = (Vector3::new(0.0, 0.0, -1.0), scene.distance(&Vector3::new(0.0, 0.0, -1.0), &beam));
        let met = place + beam * far;
        assert!((met.z - scene.floor(&met)).abs() < 1e-9);
    }

    #[test]
    fn conditions_have_steps_ceilings_and_floors_that_move() {
        assert_eq!(Scene::under(&Conditions::GENTLE), Scene::LEVEL);
        let east = core::f64::consts::FRAC_PI_2;
        let conditions = Conditions {
            ceiling: 2.4,
            floor_step: 0.2,
            floor_step_distance: 0.5,
            floor_step_bearing: east,
            floor_north: 0.1,
            ..Conditions::GENTLE
        };
        let scene = Scene::under(&conditions);
        let at = |north: f64, east: f64| scene.floor(&Vector3::new(north, east, -1.0));
        assert_eq!([at(0.0, 0.4), at(2.0, 0.4), at(0.0, 0.6), at(-2.0, 0.6)], [0.0, 0.0, -0.2, -0.2]);
        assert_eq!((scene.ceiling, scene.floor_velocity), (Some(2.4), [0.1, 0.0]));
        // A vehicle that descends onto the step stands on it and moves north with it.
        let parameters = PlantParameters { manufacturing_spread: 0.0, ..PlantParameters::EXAMPLE };
        let pose = Pose { rotors: 0.0, position: Vector3::new(0.0, 0.8, -0.3), ..Pose::hovering(0.3) };
        let mut plant = Plant::under(&parameters, &conditions, &WindConfig::CALM, Some(&pose), 1);
        (0..4800).for_each(|_| plant.step());
        let motion = plant.motion();
        assert!((motion.position.z + 0.2 + parameters.ground_height).abs() < 2e-3, "{motion:?}");
        assert!((motion.velocity.x - 0.1).abs() < 0.01, "{motion:?}");
    }

    #[test]
    fn a_floor_that_moves_takes_along_what_stands_on_it() {
        let mut plant = plant(0.05);
        (0..1600).for_each(|_| plant.step());
        plant.scene_mut().floor_velocity = [0.2, 0.0];
        (0..3200).for_each(|_| plant.step());
        assert!((plant.motion().velocity.x - 0.2).abs() < 0.02, "{:?}", plant.motion());
    }
}
