//! Conversions between attitudes and angles, which need trigonometric functions.
//!
//! Roll, pitch and yaw are for people and plots. Control laws use axis and angle, or the quaternion
//! itself.

use super::{Quat, Vec3};
use crate::math;

/// Square of half an angle, rad², up to which the rotation counts as the identity, to avoid a
/// division by zero.
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

    /// A rotation by `angle`, radians, about an axis of length one.
    #[must_use]
    pub fn from_axis_angle(axis: &Vec3, angle: f32) -> Self {
        let (sin, cos) = math::sin_cos(angle * 0.5);
        let Vec3 { x, y, z } = *axis * sin;
        Self::new_unchecked(cos, x, y, z)
    }

    /// A rotation about the direction of `turn` by its length, radians. For an angular rate over a
    /// time step pass `rate * dt`.
    ///
    /// ```
    /// use stampfly_types::{Quat, Vec3};
    /// let turn = Quat::from_scaled_axis(Vec3::new(0.1, -0.2, 0.3));
    /// assert!((turn.scaled_axis() - Vec3::new(0.1, -0.2, 0.3)).norm() < 1e-6);
    /// ```
    #[must_use]
    pub fn from_scaled_axis(turn: Vec3) -> Self {
        // With the angle θ = |turn| and the axis n = turn/θ the quaternion is
        // (cos(θ/2), n·sin(θ/2)).
        let half = turn / 2.0;
        let square = half.norm_squared();
        if square <= NO_TURN {
            return Self::identity();
        }
        let angle = math::sqrt(square);
        let Vec3 { x, y, z } = half * (math::sin(angle) / angle);
        Self::new_unchecked(math::cos(angle), x, y, z)
    }

    /// Axis times angle, radians, with an angle of at most π; zero for the identity.
    #[must_use]
    pub fn scaled_axis(&self) -> Vec3 {
        let ([w, ..], vector) = (self.wxyz(), self.imag());
        let length = vector.norm();
        if length <= 0.0 {
            return Vec3::zeros();
        }
        // q and −q are the same attitude; a negative scalar would be an angle above π.
        let axis = if w >= 0.0 { vector } else { -vector } / length;
        axis * self.angle()
    }

    /// Angle of the rotation, radians, 0 to π.
    #[must_use]
    pub fn angle(&self) -> f32 {
        let [w, ..] = self.wxyz();
        // From both parts, because the arc cosine of w alone is inaccurate near zero.
        math::atan2(self.imag().norm(), w.abs()) * 2.0
    }

    /// Angle of the rotation between two attitudes, radians, 0 to π.
    #[must_use]
    pub fn angle_to(&self, other: &Self) -> f32 {
        (*other * self.inverse()).angle()
    }

    /// The same attitude with length one, after rounding has changed it. Four zeros give NaN.
    #[must_use]
    pub fn normalize(&self) -> Self {
        let length = math::sqrt(self.norm_squared());
        let [w, x, y, z] = self.wxyz().map(|value| value / length);
        Self::new_unchecked(w, x, y, z)
    }
}
