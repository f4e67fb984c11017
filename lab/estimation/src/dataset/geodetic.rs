//! Latitude, longitude and altitude as metres north, east and down of a first place.
//!
//! The radii of curvature of the WGS 84 ellipsoid at that place (Groves, "Principles of GNSS, Inertial, and Multisensor
//! Integrated Navigation Systems", 2nd edition, section 2.4) make a plane of its surroundings. Ten kilometres away that is wrong
//! by about ten metres, so it is not for long flights.

use stampfly_types::Vec3;

/// Equatorial radius, m, and squared eccentricity of WGS 84.
const RADIUS: f64 = 6_378_137.0;
const ECCENTRICITY_SQUARED: f64 = 6.694_379_990_14e-3;

/// A place on earth: degrees and metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub(super) latitude: f64,
    pub(super) longitude: f64,
    pub(super) altitude: f64,
}

impl Place {
    /// Is it a place that a receiver can be at? Zero and zero is what receivers without a fix report.
    pub(super) fn is_on_earth(&self) -> bool {
        let Self { latitude, longitude, altitude } = *self;
        let known = latitude != 0.0 || longitude != 0.0;
        known && latitude.abs() < 90.0 && longitude.abs() <= 180.0 && altitude.abs() < 1e5
    }
}

/// The surroundings of a place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Local {
    origin: Place,
    /// Metres in a degree to the north and to the east.
    north: f64,
    east: f64,
}

impl Local {
    pub(super) fn around(origin: Place) -> Self {
        let (sin, cos) = libm::sincos(origin.latitude.to_radians());
        let share = 1.0 - ECCENTRICITY_SQUARED * sin * sin;
        let across = RADIUS / libm::sqrt(share);
        let along = across * (1.0 - ECCENTRICITY_SQUARED) / share;
        let [along, across] = [along, across].map(|radius| radius + origin.altitude);
        Self { origin, north: along.to_radians(), east: (across * cos).to_radians() }
    }

    /// A place from here, NED, m.
    pub(super) fn of(&self, place: &Place) -> Vec3 {
        // The short way round the date line.
        let east = libm::remainder(place.longitude - self.origin.longitude, 360.0);
        let north = place.latitude - self.origin.latitude;
        let down = self.origin.altitude - place.altitude;
        Vec3::new((north * self.north) as f32, (east * self.east) as f32, down as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_degree_is_as_long_as_tables_say() {
        // 110.574 km and 111.320 km at the equator, 111.132 km and 78.847 km at 45 degrees.
        for (latitude, north, east) in [(0.0, 110_574.0, 111_320.0), (45.0, 111_132.0, 78_847.0)] {
            let local = Local::around(Place { latitude, longitude: 10.0, altitude: 0.0 });
            assert!((local.north - north).abs() < 1.0 && (local.east - east).abs() < 1.0, "{local:?}");
        }
    }

    #[test]
    fn the_date_line_is_no_wall() {
        let at = |longitude| Place { latitude: -17.0, longitude, altitude: 20.0 };
        let moved = Local::around(at(179.9999)).of(&Place { altitude: 25.0, ..at(-179.9999) });
        assert!(moved.x == 0.0 && (20.0..22.0).contains(&moved.y) && moved.z == -5.0, "{moved:?}");
    }

    #[test]
    fn what_is_no_place_is_no_fix() {
        let place = |latitude, longitude| Place { latitude, longitude, altitude: 0.0 };
        assert!(place(47.0, 8.0).is_on_earth() && place(0.0, 8.0).is_on_earth());
        assert!(
            ![place(0.0, 0.0), place(91.0, 0.0), place(0.0, 200.0), place(f64::NAN, 0.0)]
                .iter()
                .any(Place::is_on_earth)
        );
    }
}
