//! Pressure altitude, for drivers of barometers.
//!
//! Use it to fill `altitude` of [`BaroData`](crate::messages::BaroData) in a driver that measures
//! pressure only. The result is the height above a pressure, not above the sea: weather shifts it
//! by tens of metres, and estimators treat its offset as unknown.

use crate::math;

/// Height above the level of 101 325 Pa in the standard atmosphere (ICAO doc 7488, troposphere), m.
///
/// Accurate to half a metre up to a kilometre. NaN for a pressure below zero.
///
/// ```
/// use stampfly_types::{messages::BaroData, pressure_altitude};
/// let pressure = 95_460.8;
/// let baro = BaroData { pressure, temperature: 12.0, altitude: pressure_altitude(pressure) };
/// assert!((baro.altitude - 500.0).abs() < 0.5);
/// ```
#[must_use]
pub fn pressure_altitude(pascals: f32) -> f32 {
    44_330.77 * (1.0 - math::pow(pascals / 101_325.0, 0.190_263))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn altitudes_are_those_of_the_standard_atmosphere() {
        // ICAO doc 7488: 0, 500 and 1000 m.
        for (pascals, metres) in [(101_325.0, 0.0), (95_460.8, 500.0), (89_874.6, 1_000.0)] {
            assert_abs_diff_eq!(pressure_altitude(pascals), metres, epsilon = 0.5);
        }
    }
}
