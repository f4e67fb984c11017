//! Rotations for the attitude filters: from a rotation vector, and between two verticals.
//!
//! For general use take [`Quat`]. These functions avoid transcendentals in the path of every sample
//! and define the degenerate cases.

use crate::filter::state::small_rotation;
use stampfly_types::{Quat, Vec3, math};

/// Whether every component is within ±`limit`; false for NaN.
pub(super) fn within(vector: &Vec3, limit: f32) -> bool {
    // Comparisons with NaN are false.
    vector.iter().all(|value| value.abs() <= limit)
}

/// Rotation by a rotation vector, rad.
///
/// By a series below a quarter of a radian, where it is exact to `f32`.
pub(super) fn from_vector(vector: &Vec3) -> Quat {
    let half = vector * 0.5;
    let square = half.norm_squared();
    if square < 0.0156 {
        let [w, x, y, z] = small_rotation(*vector);
        return Quat::new_unchecked(w, x, y, z);
    }
    let angle = math::sqrt(square);
    let (sin, cos) = math::sin_cos(angle);
    let Vec3 { x, y, z } = half * (sin / angle);
    Quat::new_unchecked(cos, x, y, z)
}

/// Normalised product; the first factor if the product has degenerated.
pub(super) fn product(first: &Quat, second: &Quat) -> Quat {
    let product = *first * *second;
    let square = product.norm_squared();
    if square > 0.25 && square < 4.0 {
        // Close to one: a second-order expansion of the inverse square root is exact to `f32`.
        let off = square - 1.0;
        let scale = if off.abs() < 1e-3 { 1.0 - off * (0.5 - 0.375 * off) } else { 1.0 / math::sqrt(square) };
        let [w, x, y, z] = product.wxyz().map(|value| value * scale);
        Quat::new_unchecked(w, x, y, z)
    } else {
        *first
    }
}

/// Shortest rotation that turns a specific force upwards, to (0, 0, −1). `None` in free fall.
///
/// Its axis is horizontal, so the heading does not change. A force straight down is rotated about
/// x.
pub(super) fn upwards(force: &Vec3) -> Option<Quat> {
    let norm = force.norm();
    if norm.is_nan() || norm < 0.1 {
        return None;
    }
    let force = force / norm;
    let real = 1.0 - force.z;
    if real < 1e-6 {
        return Some(Quat::new_unchecked(0.0, 1.0, 0.0, 0.0));
    }
    let scale = 1.0 / math::sqrt(real * real + force.x * force.x + force.y * force.y);
    Some(Quat::new_unchecked(real * scale, -force.y * scale, force.x * scale, 0.0 * scale))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn series_and_exact_agree(x in -2.0f32..2.0, y in -2.0f32..2.0, z in -2.0f32..2.0, size in 0.0f32..1.0) {
            let vector = Vec3::new(x, y, z) * size;
            let (ours, exact) = (from_vector(&vector), Quat::from_scaled_axis(vector));
            let off = ours.wxyz().into_iter().zip(exact.wxyz()).map(|(ours, exact)| (ours - exact).abs());
            prop_assert!(off.fold(0.0, f32::max) < 5e-7, "{ours:?} {exact:?}");
        }

        #[test]
        fn any_force_is_turned_upwards_about_a_level_axis(x in -20f32..20.0, y in -20f32..20.0, z in -20f32..20.0) {
            let force = Vec3::new(x, y, z);
            prop_assume!(force.norm() > 0.2);
            let turn = upwards(&force).unwrap();
            let up = (turn * force) / force.norm();
            prop_assert!((up + Vec3::z()).amax() < 2e-3 && turn.wxyz()[3].abs() < 1e-9, "{up:?}");
            prop_assert!((turn.norm_squared() - 1.0).abs() < 2e-5);
        }
    }

    #[test]
    fn degenerate_forces() {
        assert!(upwards(&Vec3::zeros()).is_none() && upwards(&Vec3::new(f32::NAN, 0.0, 0.0)).is_none());
        let over = upwards(&Vec3::new(0.0, 0.0, 9.8)).unwrap();
        assert!((over * Vec3::z() + Vec3::z()).amax() < 1e-6);
    }
}
