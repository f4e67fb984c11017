//! Attitude quaternions and their arithmetic without trigonometric functions.
//!
//! Hamilton's convention, scalar first. Conversions from and to angles are in
//! [`rotation`](super::rotation).

use super::Vec3;
use core::ops::{Mul, MulAssign, Neg};

/// An attitude: a unit quaternion that turns body vectors into world vectors with
/// `attitude * vector`, and back with [`inverse_transform_vector`](Self::inverse_transform_vector).
///
/// ```
/// use stampfly_types::{Quat, Vec3};
///
/// // Nose to the east: forward is east, and the body's right is south.
/// let attitude = Quat::from_euler_angles(0.0, 0.0, core::f32::consts::FRAC_PI_2);
/// assert!((attitude * Vec3::x() - Vec3::y()).norm() < 1e-6);
/// assert!((attitude.inverse_transform_vector(&-Vec3::x()) - Vec3::y()).norm() < 1e-6);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "[f32; 4]", into = "[f32; 4]"))]
pub struct Quat {
    w: f32,
    x: f32,
    y: f32,
    z: f32,
}

/// The squares of the four numbers do not add up to one within 2 %, so they are not an attitude.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotUnit;

impl core::fmt::Display for NotUnit {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("the length of the quaternion is not one")
    }
}

impl core::error::Error for NotUnit {}

/// Tolerance of the squared length of a stored quaternion: 1 % of the length. Rounding errors are
/// 10⁻⁶.
const UNIT: f32 = 0.02;

impl Quat {
    /// No rotation: level, nose to the north.
    #[inline]
    #[must_use]
    pub const fn identity() -> Self {
        Self::new_unchecked(1.0, 0.0, 0.0, 0.0)
    }

    /// Makes a quaternion from its scalar and its vector part without a check of the length, which
    /// must be one. With another length it also scales the vectors it turns. Use `try_from` for
    /// numbers from outside.
    #[inline]
    #[must_use]
    pub const fn new_unchecked(w: f32, x: f32, y: f32, z: f32) -> Self {
        Self { w, x, y, z }
    }

    /// The scalar, then the vector part.
    #[inline]
    #[must_use]
    pub const fn wxyz(&self) -> [f32; 4] {
        [self.w, self.x, self.y, self.z]
    }

    /// The vector part: the axis of the rotation times the sine of half its angle.
    #[inline]
    #[must_use]
    pub const fn imag(&self) -> Vec3 {
        Vec3::new(self.x, self.y, self.z)
    }

    /// The reverse rotation.
    #[inline]
    #[must_use]
    pub const fn inverse(&self) -> Self {
        Self::new_unchecked(self.w, -self.x, -self.y, -self.z)
    }

    /// The square of the length: one, apart from rounding.
    #[inline]
    #[must_use]
    pub const fn norm_squared(&self) -> f32 {
        (self.x * self.x + self.z * self.z) + (self.y * self.y + self.w * self.w)
    }

    /// Whether all numbers are finite and the length is one within 1 %.
    #[inline]
    #[must_use]
    pub fn is_unit(&self) -> bool {
        // False for NaN, too, since every comparison with NaN is.
        (self.norm_squared() - 1.0).abs() < UNIT
    }

    /// Turns a body vector into the world frame; equal to `self * vector`.
    #[inline]
    #[must_use]
    pub fn transform_vector(&self, vector: &Vec3) -> Vec3 {
        *self * *vector
    }

    /// Turns a world vector into the body frame.
    #[inline]
    #[must_use]
    pub fn inverse_transform_vector(&self, vector: &Vec3) -> Vec3 {
        self.inverse() * *vector
    }

    /// The rotation matrix, row by row. Its columns are the body's axes in the world frame.
    #[inline]
    #[must_use]
    pub const fn to_matrix(&self) -> [[f32; 3]; 3] {
        let [w, x, y, z] = self.wxyz();
        let (ww, xx, yy, zz) = (w * w, x * x, y * y, z * z);
        let (xy, xz, yz) = (x * y * 2.0, x * z * 2.0, y * z * 2.0);
        let (wx, wy, wz) = (w * x * 2.0, w * y * 2.0, w * z * 2.0);
        [
            [ww + xx - yy - zz, xy - wz, wy + xz],
            [wz + xy, ww - xx + yy - zz, yz - wx],
            [xz - wy, wx + yz, ww - xx - yy + zz],
        ]
    }
}

impl Default for Quat {
    fn default() -> Self {
        Self::identity()
    }
}

/// Accepts scalar and vector part when the length is one within 1 %. The numbers are stored
/// unchanged, so an attitude from a log is identical to the last bit.
impl TryFrom<[f32; 4]> for Quat {
    type Error = NotUnit;

    #[inline]
    fn try_from([w, x, y, z]: [f32; 4]) -> Result<Self, NotUnit> {
        let quaternion = Self::new_unchecked(w, x, y, z);
        if quaternion.is_unit() { Ok(quaternion) } else { Err(NotUnit) }
    }
}

impl From<Quat> for [f32; 4] {
    #[inline]
    fn from(quaternion: Quat) -> Self {
        quaternion.wxyz()
    }
}

/// The other quaternion of the same attitude.
impl Neg for Quat {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        let [w, x, y, z] = self.wxyz();
        Self::new_unchecked(-w, -x, -y, -z)
    }
}

// Composition: the rotation on the right is applied first.
operator!(Mul, mul, Quat, Quat, Quat, |first, second| {
    let ([aw, ax, ay, az], [bw, bx, by, bz]) = (first.wxyz(), second.wxyz());
    Quat::new_unchecked(
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )
});

// The rotated vector v + 2·w·(u × v) + 2·u × (u × v), with the scalar w and the vector part u.
operator!(Mul, mul, Quat, Vec3, Vec3, |quaternion, vector| {
    let axis = quaternion.imag();
    let twice = axis.cross(&vector) * 2.0;
    twice * quaternion.w + axis.cross(&twice) + vector
});

impl MulAssign for Quat {
    #[inline]
    fn mul_assign(&mut self, right: Self) {
        *self = *self * right;
    }
}
