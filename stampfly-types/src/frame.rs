//! Vectors, quaternions and how the stack orients them.
//!
//! | frame | x | y | z |
//! |---|---|---|---|
//! | body (FRD) | forward | right | down |
//! | world (NED) | north | east | down |
//!
//! An attitude is the unit quaternion that turns body vectors into world vectors: `world = q * body`. Roll, pitch
//! and yaw are the aerospace sequence (yaw first about z, then pitch about y, then roll about x) and exist for
//! people and plots; no control law uses them, because they are singular at ±90° of pitch.

use crate::math;

/// A vector of three `f32`. The frame and unit are part of the name or the documentation of whoever holds it.
pub type Vec3 = nalgebra::Vector3<f32>;

/// An attitude: body → world.
pub type Quat = nalgebra::UnitQuaternion<f32>;

/// Standard gravity, m/s² (ISO 80000-3).
pub const GRAVITY: f32 = 9.806_65;

/// Roll, pitch and yaw of an attitude, radians.
///
/// ```
/// use stampfly_types::{Quat, frame::roll_pitch_yaw};
/// let [roll, pitch, yaw] = roll_pitch_yaw(&Quat::from_euler_angles(0.1, -0.2, 0.3));
/// assert!((roll - 0.1).abs() < 1e-6 && (pitch + 0.2).abs() < 1e-6 && (yaw - 0.3).abs() < 1e-6);
/// ```
#[must_use]
pub fn roll_pitch_yaw(attitude: &Quat) -> [f32; 3] {
    let q = attitude.quaternion();
    let (w, x, y, z) = (q.w, q.i, q.j, q.k);
    [math::atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)), math::asin(2.0 * (w * y - z * x)), yaw(attitude)]
}

/// Heading of an attitude, radians, zero north and positive to the east.
#[must_use]
pub fn yaw(attitude: &Quat) -> f32 {
    let q = attitude.quaternion();
    math::atan2(2.0 * (q.w * q.k + q.i * q.j), 1.0 - 2.0 * (q.j * q.j + q.k * q.k))
}

/// Angle between the body's z axis and the vertical, radians, 0 to π.
///
/// ```
/// use stampfly_types::{Quat, frame::tilt};
/// assert!((tilt(&Quat::from_euler_angles(0.3, 0.0, 2.0)) - 0.3).abs() < 1e-6);
/// ```
#[must_use]
pub fn tilt(attitude: &Quat) -> f32 {
    let q = attitude.quaternion();
    // Half-angle form: precise near zero, where the arc cosine of a number close to one is not.
    2.0 * math::atan2(math::sqrt(q.i * q.i + q.j * q.j), math::sqrt(q.w * q.w + q.k * q.k))
}

/// Cosine of [`tilt`]: what to compare with a limit, because it takes no root and no arc tangent. Not for a tilt near zero,
/// whose cosine hardly changes.
///
/// ```
/// use stampfly_types::{Quat, frame::cos_tilt};
/// assert!((cos_tilt(&Quat::from_euler_angles(0.3, 0.0, 2.0)) - 0.3f32.cos()).abs() < 1e-6);
/// ```
#[must_use]
pub fn cos_tilt(attitude: &Quat) -> f32 {
    let q = attitude.quaternion();
    1.0 - 2.0 * (q.i * q.i + q.j * q.j)
}

/// The attitude with this heading and no tilt.
#[must_use]
pub fn from_yaw(yaw: f32) -> Quat {
    let (sin, cos) = math::sin_cos(0.5 * yaw);
    Quat::new_unchecked(nalgebra::Quaternion::new(cos, 0.0, 0.0, sin))
}
