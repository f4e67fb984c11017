//! An attitude, and the arithmetic that needs no angle.
//!
//! Quaternions multiply as Hamilton's do, the scalar is named first. What needs sines is in [`rotation`](super::rotation).

use super::Vec3;
use core::ops::{Mul, MulAssign, Neg};

/// An attitude, body → world: a quaternion of length one. It turns a body vector into the world's with `attitude * vector`,
/// and back with [`inverse_transform_vector`](Self::inverse_transform_vector).
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

/// Four numbers whose squares do not add up to one within 2 %: no attitude.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotUnit;

impl core::fmt::Display for NotUnit {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("the length of the quaternion is not one")
    }
}

impl core::error::Error for NotUnit {}

/// How far the squared length of a stored quaternion may be from one: 1 % of the length. Rounding makes 10⁻⁶ of it.
const UNIT: f32 = 0.02;

impl Quat {
    /// No turn: level, nose to the north.
    #[inline]
    #[must_use]
    pub const fn identity() -> Self {
        Self::new_unchecked(1.0, 0.0, 0.0, 0.0)
    }

    /// Of a scalar and a vector part whose length is known to be one. With another length it also scales what it turns; whoever
    /// gets numbers from outside takes `try_from`.
    #[inline]
    #[must_use]
    pub const fn new_unchecked(w: f32, x: f32, y: f32, z: f32) -> Self {
        Self { w, x, y, z }
    }

    /// Scalar, then vector part.
    #[inline]
    #[must_use]
    pub const fn wxyz(&self) -> [f32; 4] {
        [self.w, self.x, self.y, self.z]
    }

    /// The vector part: the axis of the turn, as long as the sine of half its angle.
    #[inline]
    #[must_use]
    pub const fn imag(&self) -> Vec3 {
        Vec3::new(self.x, self.y, self.z)
    }

    /// The turn back.
    #[inline]
    #[must_use]
    pub const fn inverse(&self) -> Self {
        Self::new_unchecked(self.w, -self.x, -self.y, -self.z)
    }

    /// The square of its length: one, but for rounding.
    #[inline]
    #[must_use]
    pub const fn norm_squared(&self) -> f32 {
        (self.x * self.x + self.z * self.z) + (self.y * self.y + self.w * self.w)
    }

    /// Is every number finite and the length one, within 1 %?
    #[inline]
    #[must_use]
    pub fn is_unit(&self) -> bool {
        (self.norm_squared() - 1.0).abs() < UNIT
    }

    /// A body vector in the world's axes; the same as `self * vector`.
    #[inline]
    #[must_use]
    pub fn transform_vector(&self, vector: &Vec3) -> Vec3 {
        *self * *vector
    }

    /// A world vector in the body's axes.
    #[inline]
    #[must_use]
    pub fn inverse_transform_vector(&self, vector: &Vec3) -> Vec3 {
        self.inverse() * *vector
    }

    /// The rotation matrix, row by row: the columns are the body's axes in the world's.
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

/// From scalar and vector part, when their length is one within 1 %. They are taken as they are: what was stored comes back to
/// the last bit.
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

// First the right one, then the left one.
operator!(Mul, mul, Quat, Quat, Quat, |first, second| {
    let ([aw, ax, ay, az], [bw, bx, by, bz]) = (first.wxyz(), second.wxyz());
    Quat::new_unchecked(
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )
});

// A vector v turned: v + 2·w·(u × v) + 2·u × (u × v), with the scalar w and the vector part u.
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
