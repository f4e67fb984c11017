//! The way down to a strip: from which side, along which line, how fast, and how the last metres fade.
//!
//! It lands against the wind: of the strip's two directions it takes the one with less wind from behind, on the point where the aircraft took off. The line comes down at [`SLOPE`], crosses the aiming point at a height, and
//! ends in a flare whose rate of sink fades with the height. Which of it is flown when is a landing mode's decision; this only says what is demanded. Not for a landing without a
//! known position.

use super::demand::{Demand, Vertical};
use super::runway::{self, Runway, SLOPE, SlopePoints};
use super::track::Track;
use stampfly_types::{Origin, math};

/// The slope is met this far before it begins, m, so that it is flown in a straight line.
const BEFORE: f32 = 120.0;
/// And its line from aside by so many radii of a turn, for whoever comes from the other end of the strip.
const ASIDE: f32 = 2.5;

/// How an aircraft comes down.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ApproachConfig {
    /// Airspeed on the slope in still air, m/s. Half of the wind is added: its gusts are about that.
    pub speed: f32,
    /// The approach begins at this height above the strip, m.
    pub height: f32,
    /// The slope is this high above the aiming point, m: what comes short must not land before it.
    pub crossing: f32,
    /// Rate of sink at touchdown, m/s.
    pub sink: f32,
    /// Time in which the height above the strip fades in the flare, s.
    pub flare: f32,
    /// Radius of a turn, m.
    pub radius: f32,
    /// Largest bank along the strip, rad.
    pub bank_max: f32,
}

/// One approach.
///
/// ```
/// use stampfly_control::fixed_wing::{Approach, ApproachConfig, Vertical, runway::Runway};
/// use stampfly_types::Origin;
/// let config = ApproachConfig { speed: 12.0, height: 40.0, crossing: 2.0, sink: 0.4, flare: 3.0, radius: 70.0, bank_max: 0.35 };
/// let origin = Origin { latitude: 470_000_000, longitude: 80_000_000, altitude: 0 };
/// let strip = Runway::at(&origin, [0.0, 0.0], 0.0, 0.0);
/// // Wind to the north: from behind, for who lands to the north. So it lands to the south.
/// let approach = Approach::new(&strip, [4.0, 0.0], &origin, &config);
/// assert!((approach.heading().abs() - 3.1416).abs() < 1e-3);
/// let demand = approach.slope([200.0, 0.0], 12.0);
/// assert!(demand.vertical == Vertical::Height && (demand.height - 18.6).abs() < 0.1 && demand.speed == 14.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Approach {
    config: ApproachConfig,
    heading: f32,
    points: SlopePoints,
    /// The same, m north and east of the origin.
    aiming: [f32; 2],
    intersection: [f32; 2],
    /// Where the ground is, m above the origin.
    ground: f32,
    speed: f32,
}

impl Approach {
    /// To a strip in this wind, m/s north and east.
    #[must_use]
    pub fn new(strip: &Runway, [north, east]: [f32; 2], origin: &Origin, config: &ApproachConfig) -> Self {
        let (sin, cos) = math::sin_cos(strip.heading);
        let is_behind = north * cos + east * sin > 0.0;
        let heading = if is_behind { math::wrap_angle(strip.heading + math::PI) } else { strip.heading };
        let altitude = strip.height + config.height;
        let points = SlopePoints::new(strip.place, f64::from(heading).to_degrees(), altitude.into());
        let [aiming, intersection] = [points.aiming, points.intersection].map(|place| runway::local(origin, &place));
        let speed = config.speed + 0.5 * math::sqrt(north * north + east * east);
        Self { config: *config, heading, points, aiming, intersection, ground: strip.height, speed }
    }

    /// Direction of the landing, rad.
    #[must_use]
    pub const fn heading(&self) -> f32 {
        self.heading
    }

    /// True airspeed on the slope, m/s.
    #[must_use]
    pub const fn speed(&self) -> f32 {
        self.speed
    }

    /// Where the approach begins, m above the origin.
    #[must_use]
    pub fn height(&self) -> f32 {
        self.ground + self.config.height
    }

    /// How high above the strip a height above the origin is, m.
    #[must_use]
    pub fn above(&self, height: f32) -> f32 {
        height - self.ground
    }

    /// How far a place is to the right of the strip's middle, m.
    #[must_use]
    pub fn aside(&self, here: [f32; 2]) -> f32 {
        let [_, aside] = runway::along(self.aiming, here, self.heading);
        aside
    }

    /// The way to the slope from here: from aside, so that no turn is longer than half a circle.
    #[must_use]
    pub fn way(&self, here: [f32; 2]) -> [[f32; 2]; 4] {
        let before = runway::ahead(self.intersection, self.heading, -BEFORE);
        let side = if self.aside(here) < 0.0 { -1.0 } else { 1.0 };
        let entry = runway::ahead(before, self.heading + math::FRAC_PI_2, side * ASIDE * self.config.radius);
        [entry, before, self.intersection, self.aiming]
    }

    /// Along the middle of the strip.
    fn middle(&self) -> Demand {
        Demand::track(Track::Line { through: self.aiming, course: self.heading }, self.config.bank_max)
    }

    /// Down the slope, from here, at this speed over the ground, m/s.
    #[must_use]
    pub fn slope(&self, here: [f32; 2], ground_speed: f32) -> Demand {
        let with_altitude = |[north, east]: [f32; 2], altitude: f64| [north.into(), east.into(), altitude];
        let aiming = with_altitude(self.aiming, self.points.aiming.altitude);
        let intersection = with_altitude(self.intersection, self.points.intersection.altitude);
        let height = runway::slope_altitude(here.map(f64::from), aiming, intersection) as f32;
        let climb = -ground_speed * math::tan(SLOPE);
        self.middle().at(height + self.config.crossing, climb).fast(self.speed)
    }

    /// The last metres, from this height above the origin, m: the throttle closed, and a rate of sink that fades.
    #[must_use]
    pub fn flare(&self, height: f32, ground_speed: f32) -> Demand {
        let sink = self.config.sink + self.above(height).max(0.0) / self.config.flare;
        let climb = -sink.min(ground_speed * math::tan(SLOPE));
        Demand { vertical: Vertical::Climb, climb, speed: self.speed, ..self.middle() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONFIG: ApproachConfig = ApproachConfig {
        speed: 12.0,
        height: 40.0,
        crossing: 2.0,
        sink: 0.4,
        flare: 3.0,
        radius: 70.0,
        bank_max: 0.35,
    };

    fn approach(wind: [f32; 2]) -> Approach {
        let origin = Origin { latitude: 470_000_000, longitude: 80_000_000, altitude: 0 };
        Approach::new(&Runway::at(&origin, [10.0, -20.0], 5.0, 0.6), wind, &origin, &CONFIG)
    }

    #[test]
    fn it_comes_from_the_side_where_it_is_and_ends_where_it_aims() {
        let approach = approach([0.0; 2]);
        for side in [-80.0, 80.0] {
            let here = runway::ahead([10.0, -20.0], 0.6 + math::FRAC_PI_2, side);
            let [entry, before, intersection, aiming] = approach.way(here);
            assert_eq!(approach.aside(entry) > 0.0, side > 0.0);
            for place in [before, intersection, aiming] {
                assert!(approach.aside(place).abs() < 0.01);
            }
            // 40 m at 5° are 457 m.
            let [length, _] = runway::along(intersection, aiming, 0.6);
            assert!((length - 457.2).abs() < 0.5, "{length}");
        }
    }

    #[test]
    fn the_sink_fades_and_is_never_steeper_than_the_slope() {
        let approach = approach([0.0; 2]);
        let sink = |height: f32| -approach.flare(height + 5.0, 12.0).climb;
        assert!((sink(40.0) - 12.0 * math::tan(SLOPE)).abs() < 1e-4);
        assert!((sink(0.6) - 0.6).abs() < 1e-4 && (sink(-1.0) - 0.4).abs() < 1e-6);
    }
}
