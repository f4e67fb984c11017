//! The magnetic field as a vector: all three axes, tilt included.
//!
//! A field m of the world reads m_b = Rᵀ·m in the body; a small body rotation θ gives (I − \[θ\]×)·m_b =
//! m_b + \[m_b\]×·θ. Everything is divided by the field's strength, so that readings are directions and the noise is
//! an angle.
//!
//! For a vehicle whose motors do not bend the field: a rover, a hand-held sensor, a machine with its magnetometer on a
//! mast. Otherwise use the [`heading`](super::heading), which leaves the tilt alone.
//!
//! | in [`Eskf`](crate::Eskf) | condition |
//! |---|---|
//! | start | `mag_enable` with [`MagModel::Field`](crate::MagModel::Field), a calibration with a field, 10 to 100 µT, a horizontal part above 1 µT |
//! | continue | the same, and a joint test ratio of the three axes of at most one |
//! | stop | one of these fails: refused at once, inactive one second after the last accepted field |
//! | inflate | rejected for longer than `lockout`: the heading's variance grows, once per lock-out |
//! | reset | none: the attitude is never set to the field |

use super::Row;
use crate::filter::ATTITUDE;
use crate::filter::state::{Rotation, rotate_back};
use stampfly_types::{Vec3, math};

/// Direction of the earth's field, true NED, unit length, at a place with this declination (magnetic north east of true north) and
/// inclination (below the horizon), rad. Both come from a map, such as the World Magnetic Model.
///
/// ```
/// // Tokyo, 2025: 7.9° west, 50° down.
/// let field = stampfly_eskf::aid::field::earth(-7.9f32.to_radians(), 50f32.to_radians());
/// assert!(field.x > 0.6 && field.y < 0.0 && field.z > 0.7);
/// ```
#[must_use]
pub fn earth(declination: f32, inclination: f32) -> Vec3 {
    let (sin, cos) = (math::sin(declination), math::cos(declination));
    let level = math::cos(inclination);
    Vec3::new(level * cos, level * sin, math::sin(inclination))
}

/// Predicted direction of the field along body x, y and z, for the direction `reference` (world, unit length).
#[inline]
#[must_use]
pub fn direction(rotation: &Rotation, reference: &Vec3) -> [Row; 3] {
    let m = rotate_back(rotation, reference);
    [
        Row::new(m.x, [(ATTITUDE + 1, -m.z), (ATTITUDE + 2, m.y)]),
        Row::new(m.y, [(ATTITUDE, m.z), (ATTITUDE + 2, -m.x)]),
        Row::new(m.z, [(ATTITUDE, -m.y), (ATTITUDE + 1, m.x)]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jacobian_matches_numerical_differentiation() {
        let reference = Vec3::new(22.0, -9.0, 38.0).normalize();
        for axis in 0..3 {
            crate::aid::numeric::check(|state| direction(&state.rotation(), &reference)[axis]);
        }
    }
}
