//! The magnetic field as a vector: all three axes, including tilt.
//!
//! A world field m reads m_b = Rᵀ·m in the body. A small body rotation θ gives (I − \[θ\]×)·m_b =
//! m_b + \[m_b\]×·θ. Readings are divided by the field strength, so that they are directions and
//! their noise is an angle.
//!
//! Use it where motors do not distort the field: a rover, a hand-held sensor, a magnetometer on a
//! mast. Otherwise use [`heading`](super::heading), which does not affect the tilt.
//!
//! Conditions in [`Eskf`](crate::Eskf):
//! - **Start**: `mag_enable` with [`MagModel::Field`](crate::MagModel::Field), a calibration with a
//!   field, 10 to 100 µT, a horizontal component above 1 µT.
//! - **Continue**: the same, and a joint test ratio of the three axes of at most one.
//! - **Stop**: a condition fails, refused at once. Inactive one second after the last accepted
//!   field.
//! - **Inflation**: rejected for longer than `lockout`. The heading variance grows, once per
//!   lock-out.
//! - **Reset**: none. The attitude is never set to the field.

use super::Row;
use crate::filter::ATTITUDE;
use crate::filter::state::{Rotation, rotate_back};
use stampfly_types::{Vec3, math};

/// Direction of the earth's field, true NED, unit length. `declination` (magnetic north east of
/// true north) and `inclination` (below the horizon) are in rad; take both from a map such as the
/// World Magnetic Model.
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

/// Predicted direction of the field along body x, y and z for the world direction `reference`, unit
/// length.
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
