//! Vectors, quaternions and the frames they refer to.
//!
//! | frame | x | y | z |
//! |---|---|---|---|
//! | body (FRD) | forward | right | down |
//! | world (NED) | north | east | down |
//!
//! An attitude is the unit quaternion that turns body vectors into world vectors:
//! `world = q * body`. Roll, pitch and yaw are the aerospace sequence (yaw first about z, then
//! pitch about y, then roll about x). They are for people and plots. No control law uses them,
//! because they are singular at ±90° of pitch.

/// Implements a binary operator for values and for references, which iterators and closures yield.
macro_rules! operator {
    ($Trait:ident, $function:ident, $Left:ty, $Right:ty, $Output:ty, |$left:ident, $right:ident| $result:expr) => {
        impl $Trait<$Right> for $Left {
            type Output = $Output;
            #[inline]
            fn $function(self, $right: $Right) -> $Output {
                let $left = self;
                $result
            }
        }
        impl $Trait<&$Right> for $Left {
            type Output = $Output;
            #[inline]
            fn $function(self, right: &$Right) -> $Output {
                self.$function(*right)
            }
        }
        impl $Trait<$Right> for &$Left {
            type Output = $Output;
            #[inline]
            fn $function(self, right: $Right) -> $Output {
                (*self).$function(right)
            }
        }
        impl $Trait<&$Right> for &$Left {
            type Output = $Output;
            #[inline]
            fn $function(self, right: &$Right) -> $Output {
                (*self).$function(*right)
            }
        }
    };
}

mod quaternion;
#[cfg(feature = "math")]
mod rotation;
mod vector;

#[cfg(feature = "nalgebra")]
mod linear_algebra;

pub use quaternion::{NotUnit, Quat};
pub use vector::Vec3;

#[cfg(feature = "math")]
use crate::math;

/// Standard gravity, m/s² (ISO 80000-3).
pub const GRAVITY: f32 = 9.806_65;

/// Roll, pitch and yaw of an attitude, radians.
///
/// ```
/// use stampfly_types::{Quat, frame::roll_pitch_yaw};
/// let [roll, pitch, yaw] = roll_pitch_yaw(&Quat::from_euler_angles(0.1, -0.2, 0.3));
/// assert!((roll - 0.1).abs() < 1e-6 && (pitch + 0.2).abs() < 1e-6 && (yaw - 0.3).abs() < 1e-6);
/// ```
#[cfg(feature = "math")]
#[must_use]
pub fn roll_pitch_yaw(attitude: &Quat) -> [f32; 3] {
    let [w, x, y, z] = attitude.wxyz();
    // `math::asin` clamps its argument, which rounding can push beyond ±1 near vertical pitch.
    [math::atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)), math::asin(2.0 * (w * y - z * x)), yaw(attitude)]
}

/// Heading of an attitude, radians: zero is north, positive is east.
#[cfg(feature = "math")]
#[must_use]
pub fn yaw(attitude: &Quat) -> f32 {
    let [w, x, y, z] = attitude.wxyz();
    math::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
}

/// Angle between the body's z axis and the vertical, radians, 0 to π.
///
/// ```
/// use stampfly_types::{Quat, frame::tilt};
/// assert!((tilt(&Quat::from_euler_angles(0.3, 0.0, 2.0)) - 0.3).abs() < 1e-6);
/// ```
#[cfg(feature = "math")]
#[must_use]
pub fn tilt(attitude: &Quat) -> f32 {
    let [w, x, y, z] = attitude.wxyz();
    // Half-angle form: precise near zero, where the arc cosine of a number close to one is not.
    2.0 * math::atan2(math::sqrt(x * x + y * y), math::sqrt(w * w + z * z))
}

/// Cosine of [`tilt`]. Cheaper than the angle for a comparison with a limit, because it needs
/// neither a root nor an arc tangent. Not for tilts near zero, where the cosine hardly changes.
///
/// ```
/// use stampfly_types::{Quat, frame::cos_tilt};
/// assert!((cos_tilt(&Quat::from_euler_angles(0.3, 0.0, 2.0)) - 0.3f32.cos()).abs() < 1e-6);
/// ```
#[must_use]
pub fn cos_tilt(attitude: &Quat) -> f32 {
    let [_, x, y, _] = attitude.wxyz();
    1.0 - 2.0 * (x * x + y * y)
}

/// The level attitude with this heading, radians.
#[cfg(feature = "math")]
#[must_use]
pub fn from_yaw(yaw: f32) -> Quat {
    let (sin, cos) = math::sin_cos(0.5 * yaw);
    Quat::new_unchecked(cos, 0.0, 0.0, sin)
}
