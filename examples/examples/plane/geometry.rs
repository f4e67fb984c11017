//! Points over a flat field, the runway, and the line that an aeroplane comes down on.

use stampfly_types::math;

/// A place: m north, m east, and m above the sea.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    pub north: f32,
    pub east: f32,
    pub altitude: f32,
}

impl Point {
    /// So far away in this direction, at the same altitude.
    pub fn ahead(self, direction: f32, distance: f32) -> Self {
        let (sin, cos) = math::sin_cos(direction);
        Self { north: self.north + distance * cos, east: self.east + distance * sin, ..self }
    }

    /// Distance over the ground, m.
    pub fn distance(self, other: Self) -> f32 {
        let (north, east) = (other.north - self.north, other.east - self.east);
        math::sqrt(north * north + east * east)
    }

    /// Direction of the other one, rad.
    pub fn direction(self, other: Self) -> f32 {
        math::atan2(other.east - self.east, other.north - self.north)
    }
}

/// Where an aeroplane starts and stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Runway {
    pub threshold: Point,
    /// Where a landing is to end.
    pub stopping: Point,
    /// rad.
    pub heading: f32,
}

/// Angle of the slope: 5°.
pub const SLOPE: f32 = 5.0 / 180.0 * core::f32::consts::PI;
/// From the touchdown to the stopping point, m.
const ROLLING: f32 = 10.0;

/// The line that a landing comes down on: from the point where it crosses the present altitude to the aiming point on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slope {
    pub from: Point,
    pub aiming: Point,
}

impl Slope {
    /// The slope to this runway from this altitude, m.
    pub fn to(runway: &Runway, altitude: f32) -> Self {
        let aiming = runway.stopping.ahead(runway.heading, -ROLLING);
        let distance = (altitude - aiming.altitude).max(0.0) / math::tan(SLOPE);
        Self { from: Point { altitude, ..aiming.ahead(runway.heading, -distance) }, aiming }
    }

    /// Altitude on the line beside this point, m: A.z + t·ΔZ, where t is 0 at the aiming point A and 1 where it begins.
    pub fn altitude(&self, at: Point) -> f32 {
        let Self { from, aiming } = self;
        let (north, east) = (from.north - aiming.north, from.east - aiming.east);
        let length = north * north + east * east;
        if length <= 0.0 {
            return aiming.altitude;
        }
        let t = ((at.north - aiming.north) * north + (at.east - aiming.east) * east) / length;
        aiming.altitude + t * (from.altitude - aiming.altitude)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn point(north: f32, east: f32, altitude: f32) -> Point {
        Point { north, east, altitude }
    }

    /// (t + A.z)·ΔZ, a formula that is around, agrees with the first row and says 291 m in the second.
    #[test]
    fn the_altitude_on_the_slope_is_that_of_the_line() {
        let slope = Slope { from: point(1.0, 1.0, 2.0), aiming: point(0.0, 0.0, 1.0) };
        assert_eq!(slope.altitude(point(0.0, 1.0, 0.0)), 1.5);
        let slope = Slope { from: point(-0.01, -0.01, 100.0), aiming: point(0.0, 0.0, 3.0) };
        assert_eq!(slope.altitude(point(0.0, 0.0, 40.0)), 3.0);
    }

    #[test]
    fn the_slope_ends_before_the_stopping_point_and_begins_at_the_present_altitude() {
        let stopping = point(2.0, 1.0, 3.0);
        let runway = Runway { threshold: stopping, stopping, heading: core::f32::consts::FRAC_PI_4 };
        let slope = Slope::to(&runway, 100.0);
        // 97 m at 5° are 1108.7 m over the ground.
        assert!((slope.aiming.distance(slope.from) - 1_108.715).abs() < 0.1);
        assert!((slope.aiming.distance(stopping) - 10.0).abs() < 1e-4);
        assert!((slope.altitude(slope.from) - 100.0).abs() < 1e-3 && slope.from.altitude == 100.0);
    }
}
