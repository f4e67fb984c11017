//! A moving point with a heading: three axes and one that wraps.
//!
//! From rest, a [`Leg`] is a straight line: every axis gets the share of the bounds that lets all of them start, cruise
//! and stop at the same instants. In motion, the axes go for the new goal independently, each within its full bounds,
//! and the path bends. Speed bounds hold per axis; along a straight line they hold for the whole vector.

use stampfly_types::math;
use stampfly_types::messages::{Setpoint, SetpointAxes};
use stampfly_types::{Vec3, math::wrap_angle};

use super::{Axis, Bounds};
use crate::bound::symmetric;

/// Bounds of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PathLimits {
    /// North and east, m/s, m/s², m/s³.
    pub horizontal: Bounds,
    /// Up and down, m/s, m/s², m/s³.
    pub vertical: Bounds,
    /// Heading, rad/s, rad/s², rad/s³.
    pub heading: Bounds,
}

impl Default for PathLimits {
    /// The StampFly: calm enough that every point of the path is within easy reach of its motors.
    fn default() -> Self {
        Self {
            horizontal: Bounds { speed: 1.0, acceleration: 1.5, jerk: 8.0 },
            vertical: Bounds { speed: 0.6, acceleration: 1.5, jerk: 10.0 },
            heading: Bounds { speed: 1.5, acceleration: 4.0, jerk: 30.0 },
        }
    }
}

/// A goal and the bounds on the way to it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Leg {
    /// Where the leg ends, world frame, m.
    pub goal: Vec3,
    bounds: [Bounds; 3],
}

/// The moving point.
///
/// ```
/// use stampfly_control::guidance::{Path, PathLimits};
/// use stampfly_types::Vec3;
/// let mut path = Path::at(Vec3::new(0.0, 0.0, -1.0), 0.0, PathLimits::default());
/// let leg = path.leg_to(Vec3::new(2.0, 1.0, -1.0), 0.5);
/// while !path.ends(&leg) {
///     path.follow(&leg, 0.0025);
///     let p = path.position();
///     assert!((p.x - 2.0 * p.y).abs() < 1e-3, "a straight line");
///     assert!(path.velocity().norm() < 0.501);
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Path {
    limits: PathLimits,
    north: Axis,
    east: Axis,
    down: Axis,
    heading: Axis,
}

impl Path {
    /// At rest.
    #[must_use]
    pub fn at(position: Vec3, heading: f32, limits: PathLimits) -> Self {
        let mut path = Self {
            limits,
            north: Axis::default(),
            east: Axis::default(),
            down: Axis::default(),
            heading: Axis::default(),
        };
        path.place_horizontally(&position, &Vec3::zeros());
        path.place_vertically(position.z, 0.0);
        path.face(heading);
        path
    }

    /// Moves the point sideways without travelling, at a velocity within the bounds. Numbers that are none are
    /// ignored.
    pub fn place_horizontally(&mut self, position: &Vec3, velocity: &Vec3) {
        place(&mut self.north, position.x, velocity.x, &self.limits.horizontal);
        place(&mut self.east, position.y, velocity.y, &self.limits.horizontal);
    }

    /// Moves the point up or down without travelling, at a velocity within the bounds. Numbers that are none are
    /// ignored.
    pub fn place_vertically(&mut self, down: f32, velocity: f32) {
        place(&mut self.down, down, velocity, &self.limits.vertical);
    }

    /// Turns the heading without travelling, at rest. A number that is none is ignored.
    pub fn face(&mut self, heading: f32) {
        place(&mut self.heading, wrap_angle(heading), 0.0, &self.limits.heading);
    }

    /// Plans the leg from here to `goal`, no faster than `speed` (m/s, over all axes).
    #[must_use]
    pub fn leg_to(&self, goal: Vec3, speed: f32) -> Leg {
        let PathLimits { horizontal, vertical, .. } = self.limits;
        let full = [horizontal, horizontal, vertical];
        let way = goal - self.position();
        let length = way.norm();
        let limited = |bounds: Bounds, speed: f32| Bounds { speed: bounds.speed.min(speed), ..bounds };
        let rests = self.north.rests() && self.east.rests() && self.down.rests();
        if !rests || length < 1e-3 {
            return Leg { goal, bounds: full.map(|bounds| limited(bounds, speed)) };
        }
        // Along a straight line each axis moves with its share of the whole; the weakest axis sets the pace.
        let shares = [way.x, way.y, way.z].map(|part| part.abs() / length);
        let mut along = Bounds { speed, acceleration: f32::MAX, jerk: f32::MAX };
        for (bounds, share) in full.iter().zip(shares) {
            if share > 1e-3 {
                along.speed = along.speed.min(bounds.speed / share);
                along.acceleration = along.acceleration.min(bounds.acceleration / share);
                along.jerk = along.jerk.min(bounds.jerk / share);
            }
        }
        let mut bounds = full;
        for (bounds, share) in bounds.iter_mut().zip(shares) {
            // An axis with nothing to do keeps bounds it could correct a rounding error with.
            *bounds = along.scaled(share.max(1e-3));
        }
        Leg { goal, bounds }
    }

    /// One step along a leg.
    pub fn follow(&mut self, leg: &Leg, dt: f32) {
        self.follow_horizontally(leg, dt);
        self.follow_vertically(leg, dt);
    }

    /// One step along a leg, north and east only.
    pub fn follow_horizontally(&mut self, leg: &Leg, dt: f32) {
        let [north, east, _] = &leg.bounds;
        self.north.step_to(leg.goal.x, north, dt);
        self.east.step_to(leg.goal.y, east, dt);
    }

    /// One step along a leg, up and down only.
    pub fn follow_vertically(&mut self, leg: &Leg, dt: f32) {
        let [.., down] = &leg.bounds;
        self.down.step_to(leg.goal.z, down, dt);
    }

    /// One step towards a horizontal velocity; zero brakes and holds.
    pub fn drift(&mut self, north: f32, east: f32, dt: f32) {
        self.north.step_at(north, &self.limits.horizontal, dt);
        self.east.step_at(east, &self.limits.horizontal, dt);
    }

    /// One step towards a vertical velocity, down positive; zero brakes and holds.
    pub fn sink(&mut self, velocity: f32, dt: f32) {
        self.down.step_at(velocity, &self.limits.vertical, dt);
    }

    /// One step towards a vertical position, no faster than `speed`.
    pub fn sink_to(&mut self, down: f32, speed: f32, dt: f32) {
        let bounds = Bounds { speed: speed.min(self.limits.vertical.speed), ..self.limits.vertical };
        self.down.step_to(down, &bounds, dt);
    }

    /// One step towards a heading, the short way round.
    pub fn turn_to(&mut self, heading: f32, dt: f32) {
        let goal = self.heading.position + wrap_angle(heading - self.heading.position);
        self.heading.step_to(goal, &self.limits.heading, dt);
        self.wrap();
    }

    /// One step towards a rate of turn; zero brakes and holds.
    pub fn turn_at(&mut self, rate: f32, dt: f32) {
        self.heading.step_at(rate, &self.limits.heading, dt);
        self.wrap();
    }

    /// Has the leg come to its end?
    #[must_use]
    pub fn ends(&self, leg: &Leg) -> bool {
        self.north.rests_at(leg.goal.x) && self.east.rests_at(leg.goal.y) && self.down.rests_at(leg.goal.z)
    }

    /// Does the point rest at this heading?
    #[must_use]
    pub fn faces(&self, heading: f32) -> bool {
        self.heading.rests() && wrap_angle(heading - self.heading.position).abs() < 1e-3
    }

    /// Where the point is, m.
    #[must_use]
    pub fn position(&self) -> Vec3 {
        Vec3::new(self.north.position, self.east.position, self.down.position)
    }

    /// How fast it moves, m/s.
    #[must_use]
    pub fn velocity(&self) -> Vec3 {
        Vec3::new(self.north.velocity, self.east.velocity, self.down.velocity)
    }

    /// Heading, rad, within ±π.
    #[must_use]
    pub fn heading(&self) -> f32 {
        self.heading.position
    }

    /// The point as a set-point for these axes.
    #[must_use]
    pub fn setpoint(&self, axes: SetpointAxes) -> Setpoint {
        Setpoint {
            position: self.position(),
            velocity: self.velocity(),
            acceleration: Vec3::new(self.north.acceleration, self.east.acceleration, self.down.acceleration),
            yaw: self.heading.position,
            yaw_rate: self.heading.velocity,
            axes,
            ..Setpoint::default()
        }
    }

    /// Heading and goal may both lie anywhere; only their difference counts.
    fn wrap(&mut self) {
        if self.heading.position.abs() > math::PI {
            self.heading.position = wrap_angle(self.heading.position);
        }
    }
}

fn place(axis: &mut Axis, position: f32, velocity: f32, bounds: &Bounds) {
    if position.is_finite() {
        let velocity = if velocity.is_finite() { symmetric(velocity, bounds.speed) } else { 0.0 };
        *axis = Axis { position, velocity, acceleration: 0.0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const DT: f32 = 0.0025;

    proptest! {
        #[test]
        fn legs_from_rest_are_straight_and_keep_the_bounds(
            from in prop::array::uniform3(-3f32..3.0), to in prop::array::uniform3(-3f32..3.0), speed in 0.1f32..2.0,
        ) {
            let (from, to) = (Vec3::from(from), Vec3::from(to));
            prop_assume!((to - from).norm() > 0.05);
            let mut path = Path::at(from, 0.0, PathLimits::default());
            let leg = path.leg_to(to, speed);
            let along = (to - from).normalize();
            let mut steps = 0;
            while !path.ends(&leg) {
                path.follow(&leg, DT);
                let moved = path.position() - from;
                // Each step rounds each coordinate to its last bit, and a slow leg takes tens of thousands of steps.
                let rounding = steps as f32 * 2.0 * f32::EPSILON;
                prop_assert!((moved - along * moved.dot(&along)).norm() < 2e-3 + rounding, "off the line");
                prop_assert!(path.velocity().norm() <= speed * 1.001 + 1e-4);
                prop_assert!(path.velocity().horizontal().amax() <= 1.001 && path.velocity().z.abs() <= 0.601);
                steps += 1;
                prop_assert!(steps < 100_000, "never arrives: {path:?}");
            }
        }

        #[test]
        fn headings_turn_the_short_way(from in -3.1f32..3.1, to in -10f32..10.0) {
            let mut path = Path::at(Vec3::zeros(), from, PathLimits::default());
            let way = wrap_angle(to - from);
            prop_assume!(way.abs() < 3.1);
            let mut turned = 0.0;
            for _ in 0..4000 {
                let before = path.heading();
                path.turn_to(to, DT);
                turned += wrap_angle(path.heading() - before);
            }
            prop_assert!((turned - way).abs() < 2e-3, "turned {turned} for {way}");
            prop_assert!(path.heading().abs() <= math::PI + 1e-5);
        }

        #[test]
        fn placing_ignores_what_is_no_number(position: [f32; 3], velocity: [f32; 3], heading: f32) {
            let mut path = Path::at(Vec3::from(position), heading, PathLimits::default());
            path.place_horizontally(&Vec3::from(velocity), &Vec3::from(position));
            let point = path.setpoint(SetpointAxes::ALL);
            prop_assert!(point.position.iter().chain(&point.velocity).all(|x| x.is_finite()));
            prop_assert!(point.yaw.is_finite());
        }
    }
}
