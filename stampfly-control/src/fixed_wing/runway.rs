//! Places on Earth, the strip, and the line that a landing comes down on.
//!
//! Formulas and constants are those of the ZeroPilot path manager (WARG, University of Waterloo, 2021): a degree of latitude has 111 320 m, one of longitude 40 075 km / 360 times the cosine of the latitude, which is flat
//! ground around one place. In double precision: a landing point is good to a tenth of a millimetre, and an `f32` of degrees to a metre.

use stampfly_types::{Origin, math};

/// Metres in a degree of latitude.
const METRES: f64 = 111_320.0;
/// Of the equator, m.
const CIRCUMFERENCE: f64 = 40_075_000.0;
/// A take-off aims at a point this far ahead, m.
pub const AHEAD: f64 = 1_000.0;
/// Angle of the slope: 5°.
pub const SLOPE: f32 = 5.0 / 180.0 * core::f32::consts::PI;
/// From the touchdown to where it stops, m.
const ROLLING: f64 = 10.0;
/// The slope is entered when the track is at most so far from the strip's, rad: 80°.
const FACING: f32 = 80.0 / 180.0 * core::f32::consts::PI;

/// A place on Earth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Geodetic {
    /// Degrees, north is positive.
    pub latitude: f64,
    /// Degrees, east is positive.
    pub longitude: f64,
    /// m, above the same level as all others.
    pub altitude: f64,
}

impl Geodetic {
    /// The place so many metres away in this direction, degrees, at the same altitude.
    ///
    /// ```
    /// use stampfly_control::fixed_wing::runway::Geodetic;
    /// let here = Geodetic { latitude: 43.47, longitude: -80.54, altitude: 330.0 };
    /// assert!((here.ahead(0.0, 1_000.0).latitude - 43.478_983_11).abs() < 1e-8);
    /// ```
    #[must_use]
    pub fn ahead(self, heading: f64, distance: f64) -> Self {
        let (sin, cos) = math::sin_cos_f64(heading.to_radians());
        let (_, east) = math::sin_cos_f64(self.latitude.to_radians());
        Self {
            latitude: self.latitude + distance * cos / METRES,
            longitude: self.longitude + distance * sin / (CIRCUMFERENCE * east / 360.0),
            ..self
        }
    }
}

/// What a landing is flown along.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SlopePoints {
    /// Where the slope meets the present altitude.
    pub intersection: Geodetic,
    /// Where it meets the ground.
    pub aiming: Geodetic,
    /// Where the aircraft stops.
    pub stopping: Geodetic,
}

impl SlopePoints {
    /// Those of a landing in this direction, degrees, from this altitude.
    #[must_use]
    pub fn new(stopping: Geodetic, heading: f64, altitude: f64) -> Self {
        let aiming = stopping.ahead(heading, -ROLLING);
        let (sin, cos) = math::sin_cos_f64(f64::from(SLOPE));
        let ground = (altitude - aiming.altitude) * cos / sin;
        let intersection = Geodetic { altitude, ..aiming.ahead(heading, -ground) };
        Self { intersection, aiming, stopping }
    }
}

/// Altitude of the slope at a place: A.z + t·ΔZ with the share t of the way from the aiming point to the intersection. Places are in the plane, any unit, with altitudes behind them.
///
/// ```
/// use stampfly_control::fixed_wing::runway::slope_altitude;
/// let (aiming, intersection) = ([0.0, 0.0, 3.0], [-10.0, -10.0, 100.0]);
/// assert_eq!(slope_altitude([0.0, 0.0], aiming, intersection), 3.0, "at the aiming point it is the aiming point's");
/// ```
#[must_use]
pub fn slope_altitude([x, y]: [f64; 2], aiming: [f64; 3], intersection: [f64; 3]) -> f64 {
    let [ax, ay, az] = aiming;
    let [dx, dy, dz] = [intersection[0] - ax, intersection[1] - ay, intersection[2] - az];
    let length = dx * dx + dy * dy;
    let share = if length > 0.0 { ((x - ax) * dx + (y - ay) * dy) / length } else { 0.0 };
    az + share * dz
}

/// Does a track, rad, lead towards the strip?
#[must_use]
pub fn faces(track: f32, landing: f32) -> bool {
    // A hair of rounding must not decide about 80° exactly.
    math::wrap_angle(track - landing).abs() <= FACING + 1e-5
}

/// The strip, as the first take-off found it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Runway {
    /// Where it took off, and stops.
    pub place: Geodetic,
    /// The same, m north and east of the origin.
    pub local: [f32; 2],
    /// m above the origin.
    pub height: f32,
    /// Its direction, rad.
    pub heading: f32,
}

impl Runway {
    /// The strip at a place, m north and east of the origin.
    #[must_use]
    pub fn at(origin: &Origin, local: [f32; 2], height: f32, heading: f32) -> Self {
        let (latitude, longitude) = origin.global(local);
        let [latitude, longitude] = [latitude, longitude].map(|number| f64::from(number) * 1e-7);
        Self { place: Geodetic { latitude, longitude, altitude: height.into() }, local, height, heading }
    }
}

/// How far north and east of the origin it is, m, to two centimetres.
#[must_use]
pub fn local(origin: &Origin, place: &Geodetic) -> [f32; 2] {
    let whole = |degrees: f64| (degrees * 1e7) as i32;
    origin.local(whole(place.latitude), whole(place.longitude))
}

/// A point so far ahead in a direction, rad.
#[must_use]
pub fn ahead([north, east]: [f32; 2], direction: f32, distance: f32) -> [f32; 2] {
    let (sin, cos) = math::sin_cos(direction);
    [north + distance * cos, east + distance * sin]
}

/// How far it is from one point to another along a direction, rad, and to the right of it, m.
#[must_use]
pub fn along(from: [f32; 2], to: [f32; 2], direction: f32) -> [f32; 2] {
    let (sin, cos) = math::sin_cos(direction);
    let [north, east] = [to[0] - from[0], to[1] - from[1]];
    [north * cos + east * sin, east * cos - north * sin]
}
