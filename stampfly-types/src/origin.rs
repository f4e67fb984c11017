//! Conversion between the local frame and geographic coordinates.
//!
//! A vehicle with a satellite receiver sets the origin itself. For one that flies indoors it is
//! configured, so that a ground station can show the vehicle on a map. The Earth counts as flat
//! around the origin; the error is a millimetre at a hundred metres and a decimetre at a kilometre.

use crate::math;
use core::f32::consts::PI;

/// Metres per ten-millionth of a degree of latitude, on a sphere with the radius of the equator, 6
/// 378 137 m (WGS 84).
const METRES: f32 = 0.011_131_949;
/// 360° in ten-millionths of a degree.
const TURN: i64 = 3_600_000_000;

/// The geographic coordinates of the local frame's origin.
///
/// ```
/// use stampfly_types::Origin;
/// let origin = Origin { latitude: 473_977_418, longitude: 85_455_939, altitude: 488_000 };
/// let (latitude, longitude) = origin.global([100.0, -50.0]);
/// let [north, east] = origin.local(latitude, longitude);
/// assert!((north - 100.0).abs() < 0.02 && (east + 50.0).abs() < 0.02);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Origin {
    /// Latitude in ten-millionths of a degree, north positive.
    pub latitude: i32,
    /// Longitude in ten-millionths of a degree, east positive.
    pub longitude: i32,
    /// Altitude above mean sea level, mm.
    pub altitude: i32,
}

impl Origin {
    /// Whether the coordinates are valid and at most 89° from the equator. Nearer to a pole east is
    /// not well defined.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.latitude.unsigned_abs() <= 890_000_000 && self.longitude.unsigned_abs() <= 1_800_000_000
    }

    /// Metres per ten-millionth of a degree of longitude at this latitude.
    fn east(&self) -> f32 {
        METRES * math::cos(self.latitude as f32 * 1e-7 * (PI / 180.0))
    }

    /// Position north and east of the origin, m, from coordinates in ten-millionths of a degree.
    #[must_use]
    pub fn local(&self, latitude: i32, longitude: i32) -> [f32; 2] {
        let north = i64::from(latitude) - i64::from(self.latitude);
        // Across the 180th meridian: take the shorter way around the Earth.
        let east = (i64::from(longitude) - i64::from(self.longitude) + TURN / 2).rem_euclid(TURN) - TURN / 2;
        [north as f32 * METRES, east as f32 * self.east()]
    }

    /// Latitude and longitude, in ten-millionths of a degree, of a position north and east of the
    /// origin, m.
    #[must_use]
    pub fn global(&self, [north, east]: [f32; 2]) -> (i32, i32) {
        let latitude = i64::from(self.latitude) + i64::from((north / METRES) as i32);
        // The lower bound avoids a division by zero at a pole.
        let longitude = i64::from(self.longitude) + i64::from((east / self.east().max(METRES * 1e-3)) as i32);
        let longitude = (longitude + TURN / 2).rem_euclid(TURN) - TURN / 2;
        let narrow = |number: i64| i32::try_from(number).unwrap_or(if number < 0 { i32::MIN } else { i32::MAX });
        (narrow(latitude), narrow(longitude))
    }

    /// Position below the origin, m, from an altitude above mean sea level, m.
    #[must_use]
    pub fn down(&self, altitude: f32) -> f32 {
        self.altitude as f32 * 1e-3 - altitude
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;
    use proptest::prelude::*;

    #[test]
    fn a_degree_has_111_km_and_a_degree_east_half_of_it_at_60_degrees() {
        let origin = Origin { latitude: 600_000_000, longitude: 100_000_000, altitude: 0 };
        let [north, east] = origin.local(610_000_000, 110_000_000);
        assert!((north - 111_319.5).abs() < 1.0 && (east - 55_659.7).abs() < 1.0, "{north} {east}");
    }

    #[test]
    fn the_date_line_is_no_wall() {
        let origin = Origin { latitude: 0, longitude: 1_799_999_000, altitude: 0 };
        let [_, east] = origin.local(0, -1_799_999_000);
        assert_abs_diff_eq!(east, 22.26, epsilon = 0.01);
        assert!(origin.global([0.0, 22.26]).1 < 0);
    }

    proptest! {
        #[test]
        fn there_and_back_is_the_same_place(
            latitude in -890_000_000..890_000_000_i32,
            longitude in -1_800_000_000..1_800_000_000_i32,
            north in -1_000.0..1_000.0_f32,
            east in -1_000.0..1_000.0_f32,
        ) {
            let origin = Origin { latitude, longitude, altitude: 0 };
            let (there, where_) = origin.global([north, east]);
            let [n, e] = origin.local(there, where_);
            prop_assert!((n - north).abs() < 0.03 && (e - east).abs() < 0.03, "{} {}", n - north, e - east);
        }

        #[test]
        fn any_numbers_give_numbers(a: i32, b: i32, c: i32, d: i32, north: f32, east: f32) {
            let origin = Origin { latitude: a, longitude: b, altitude: c };
            prop_assert!(origin.local(c, d).iter().all(|metres| metres.is_finite()));
            _ = origin.global([north, east]);
        }
    }
}
