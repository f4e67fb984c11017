//! Attitudes from angles, and angles from attitudes: what needs sines and arc tangents.
//!
//! Roll, pitch and yaw are for people and plots; what controls takes an axis and an angle, or the quaternion itself.

use super::{Quat, Vec3};
use crate::math;

/// Square of half an angle, rad², below which a rotation is none: its sine divided by it would be a division by nothing.
const NO_TURN: f32 = f32::EPSILON * f32::EPSILON;

impl Quat {
    /// From roll, pitch and yaw, radians: first yaw about z, then pitch about y, then roll about x.
    #[must_use]
    pub fn from_euler_angles(roll: f32, pitch: f32, yaw: f32) -> Self {
        let (sr, cr) = math::sin_cos(roll * 0.5);
        let (sp, cp) = math::sin_cos(pitch * 0.5);
        let (sy, cy) = math::sin_cos(yaw * 0.5);
        Self::new_unchecked(
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        )
    }

    /// A turn by `angle`, radians, about an axis of length one.
    #[must_use]
    pub fn from_axis_angle(axis: &Vec3, angle: f32) -> Self {
        let (sin, cos) = math::sin_cos(angle * 0.5);
        let Vec3 { x, y, z } = *axis * sin;
        Self::new_unchecked(cos, x, y, z)
    }

    /// A turn about the direction of a vector by its length, radians: what a rate does in a time is `rate * dt`.
    ///
    /// ```
    /// use stampfly_types::{Quat, Vec3};
    /// let turn = Quat::from_scaled_axis(Vec3::new(0.1, -0.2, 0.3));
    /// assert!((turn.scaled_axis() - Vec3::new(0.1, -0.2, 0.3)).norm() < 1e-6);
    /// ```
    #[must_use]
    pub fn from_scaled_axis(turn: Vec3) -> Self {
        let half = turn / 2.0;
        let square = half.norm_squared();
        if square <= NO_TURN {
            return Self::identity();
        }
        let angle = math::sqrt(square);
        let Vec3 { x, y, z } = half * (math::sin(angle) / angle);
        Self::new_unchecked(math::cos(angle), x, y, z)
    }

    /// Axis times angle, radians, the shorter way round; zero for no turn.
    #[must_use]
    pub fn scaled_axis(&self) -> Vec3 {
        let ([w, ..], vector) = (self.wxyz(), self.imag());
        let length = vector.norm();
        if length <= 0.0 {
            return Vec3::zeros();
        }
        let axis = if w >= 0.0 { vector } else { -vector } / length;
        axis * self.angle()
    }

    /// The angle it turns by, radians, 0 to π.
    #[must_use]
    pub fn angle(&self) -> f32 {
        let [w, ..] = self.wxyz();
        math::atan2(self.imag().norm(), w.abs()) * 2.0
    }

    /// The angle between two attitudes, radians, 0 to π.
    #[must_use]
    pub fn angle_to(&self, other: &Self) -> f32 {
        (*other * self.inverse()).angle()
    }

    /// The same attitude with the length that rounding took from it. Of four zeros it makes numbers that are none.
    #[must_use]
    pub fn normalize(&self) -> Self {
        let length = math::sqrt(self.norm_squared());
        let [w, x, y, z] = self.wxyz().map(|value| value / length);
        Self::new_unchecked(w, x, y, z)
    }
}
