//! Lines and orbits: the course that leads to one and along it.
//!
//! Vector fields of Beard and McLain, chapter 10: far away the course leads straight to the path, near it along it, with the arc tangent in between. They need no
//! look-ahead point and no memory, and do not mind where they are entered. The bank that follows from a course is a coordinated turn's.

use crate::bound::symmetric;
use stampfly_types::GRAVITY;
use stampfly_types::math::{self, wrap_angle};

/// Half a turn's half.
const QUARTER: f32 = core::f32::consts::FRAC_PI_2;
/// Over ground slower than this, m/s, a course is no direction: the wind is as fast as the aircraft.
const SLOWEST: f32 = 1.0;

/// A path over the ground, m north and east.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Track {
    /// A straight line.
    Line {
        /// A point of it.
        through: [f32; 2],
        /// Its direction, rad.
        course: f32,
    },
    /// A circle.
    Orbit {
        /// Its middle.
        centre: [f32; 2],
        /// m; one that is not positive is flown as one of a metre.
        radius: f32,
        /// Seen from above.
        clockwise: bool,
    },
}

/// How paths are followed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TrackConfig {
    /// How hard a line is approached: the tangent of the angle to it for each metre beside it, 1/m.
    pub line_gain: f32,
    /// How hard an orbit is approached: the same for each radius outside of it.
    pub orbit_gain: f32,
    /// Rate of turn for an error of the course, 1/s.
    pub course_gain: f32,
    /// Largest bank, rad.
    pub bank_max: f32,
}

impl Default for TrackConfig {
    /// For some 15 m/s: a line is met within four seconds. ZeroPilot, whose aircraft is as fast, has 0.01 1/m, 1, and 20°.
    fn default() -> Self {
        Self { line_gain: 0.04, orbit_gain: 2.0, course_gain: 0.8, bank_max: 0.6 }
    }
}

/// What a track wants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steering {
    /// Course over the ground, rad, within ±π.
    pub course: f32,
    /// How fast it changes as the aircraft moves, rad/s.
    pub rate: f32,
    /// How far the path is to the left, m: negative left of it, outside of a clockwise orbit.
    pub aside: f32,
}

impl Track {
    /// The course at this place, m north and east, for someone who moves over the ground like this, m/s north and east.
    ///
    /// ```
    /// use stampfly_control::fixed_wing::{Track, TrackConfig};
    /// let config = TrackConfig::default();
    /// let north = Track::Line { through: [0.0, 0.0], course: 0.0 };
    /// assert_eq!(north.steer([10.0, 0.0], [15.0, 0.0], &config).course, 0.0);
    /// let right_of_it = north.steer([10.0, 500.0], [15.0, 0.0], &config);
    /// assert!(right_of_it.course < -1.5 && right_of_it.aside == 500.0, "turns left, almost straight to the line");
    /// ```
    #[must_use]
    pub fn steer(&self, [north, east]: [f32; 2], velocity: [f32; 2], config: &TrackConfig) -> Steering {
        match *self {
            Self::Line { through, course } => {
                let (sin, cos) = math::sin_cos(course);
                let aside = cos * (east - through[1]) - sin * (north - through[0]);
                let slope = config.line_gain * aside;
                let rate = -config.line_gain * (cos * velocity[1] - sin * velocity[0]) / (1.0 + slope * slope);
                Steering { course: wrap_angle(course - math::atan2(slope, 1.0)), rate, aside }
            }
            Self::Orbit { centre, radius, clockwise } => {
                let radius = radius.max(1.0);
                let [out_north, out_east] = [north - centre[0], east - centre[1]];
                let distance = math::sqrt(out_north * out_north + out_east * out_east);
                let turn = if clockwise { 1.0 } else { -1.0 };
                let slope = config.orbit_gain * (distance - radius) / radius;
                let inwards = math::atan2(slope, 1.0);
                let course = wrap_angle(math::atan2(out_east, out_north) + turn * (QUARTER + inwards));
                // How fast it goes round the middle, and away from it. In the middle there is no direction.
                let near = distance.max(1.0);
                let round = (out_north * velocity[1] - out_east * velocity[0]) / (near * near);
                let away = (out_north * velocity[0] + out_east * velocity[1]) / near;
                let rate = round + turn * config.orbit_gain * away / radius / (1.0 + slope * slope);
                Steering { course, rate, aside: -turn * (distance - radius) }
            }
        }
    }
}

impl Steering {
    /// Straight to this course.
    #[must_use]
    pub const fn to(course: f32) -> Self {
        Self { course, rate: 0.0, aside: 0.0 }
    }

    /// The bank that turns a present course to the wanted one at a ground speed, m/s: tan φ = V·χ̇/g. Zero while it hardly moves over the ground, or for what is no number.
    ///
    /// ```
    /// use stampfly_control::fixed_wing::{Steering, TrackConfig};
    /// let config = TrackConfig::default();
    /// let right = Steering::to(0.1).bank(0.0, 15.0, &config);
    /// assert!(right > 0.1 && right < 0.15);
    /// assert_eq!(Steering::to(3.0).bank(0.0, 15.0, &config), config.bank_max);
    /// assert_eq!(Steering::to(f32::NAN).bank(0.0, 15.0, &config), 0.0);
    /// ```
    #[must_use]
    pub fn bank(&self, course: f32, speed: f32, config: &TrackConfig) -> f32 {
        let rate = self.rate + config.course_gain * wrap_angle(self.course - course);
        let bank = math::atan2(speed * rate, GRAVITY);
        if bank.is_finite() && speed > SLOWEST { symmetric(bank, config.bank_max) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A point that turns as its bank says, for so many seconds. Returns where it is, and the mean distance from the track in the last quarter.
    fn fly(track: &Track, from: [f32; 2], course: f32, seconds: u32) -> (Steering, f32) {
        let (config, speed, dt) = (TrackConfig::default(), 15.0, 0.02);
        let (mut place, mut course, mut off) = (from, course, 0.0);
        let steps = seconds * 50;
        let mut steering = Steering::to(course);
        for step in 0..steps {
            let (sin, cos) = math::sin_cos(course);
            steering = track.steer(place, [speed * cos, speed * sin], &config);
            course = wrap_angle(course + GRAVITY / speed * math::tan(steering.bank(course, speed, &config)) * dt);
            let (sin, cos) = math::sin_cos(course);
            place = [place[0] + speed * cos * dt, place[1] + speed * sin * dt];
            if step >= steps / 4 * 3 {
                off += steering.aside.abs() / (steps / 4) as f32;
            }
        }
        (steering, off)
    }

    proptest! {
        #[test]
        fn a_line_is_met_and_followed_from_anywhere(
            north in -300f32..300.0, east in -300f32..300.0, course in -3.1f32..3.1, along in -3.1f32..3.1,
        ) {
            let track = Track::Line { through: [20.0, -40.0], course: along };
            let (_, off) = fly(&track, [north, east], course, 80);
            prop_assert!(off < 0.5, "{off} m");
        }

        #[test]
        fn an_orbit_is_met_and_followed_from_anywhere(
            north in -300f32..300.0, east in -300f32..300.0, course in -3.1f32..3.1, clockwise: bool,
        ) {
            let track = Track::Orbit { centre: [20.0, -40.0], radius: 60.0, clockwise };
            let (_, off) = fly(&track, [north, east], course, 100);
            prop_assert!(off < 1.0, "{off} m");
        }

        #[test]
        fn any_numbers_give_a_bank_within_its_bound(n: f32, e: f32, speed: f32, present: f32, radius: f32) {
            let config = TrackConfig::default();
            for track in [
                Track::Line { through: [e, n], course: radius },
                Track::Orbit { centre: [e, n], radius, clockwise: n > e },
            ] {
                let bank = track.steer([n, e], [speed, present], &config).bank(present, speed, &config);
                prop_assert!(bank.abs() <= config.bank_max);
            }
        }
    }

    #[test]
    fn aside_has_the_same_sign_left_of_a_line_and_outside_of_a_clockwise_orbit() {
        let config = TrackConfig::default();
        let line = Track::Line { through: [0.0; 2], course: 0.0 };
        let orbit = Track::Orbit { centre: [0.0, 50.0], radius: 50.0, clockwise: true };
        // At the origin, moving north, the orbit's middle is to the right.
        for track in [line, orbit] {
            assert!(track.steer([0.0, -3.0], [15.0, 0.0], &config).aside < 0.0);
            assert!(track.steer([0.0, 3.0], [15.0, 0.0], &config).aside > 0.0);
        }
    }
}
