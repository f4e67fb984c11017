//! Three-dimensional vectors.
//!
//! For messages and for the arithmetic of a flight controller: sums, multiples, lengths, dot and
//! cross products, named as in nalgebra. For matrices use nalgebra's types, into which [`Vec3`]
//! converts with the feature `nalgebra`.

use crate::comparison::{larger, smaller};
use core::iter::Sum;
use core::ops::{Add, AddAssign, Div, DivAssign, Index, IndexMut, Mul, MulAssign, Neg, Sub, SubAssign};

/// A vector of three `f32`. The field or variable that holds it documents its frame and unit.
///
/// ```
/// use stampfly_types::Vec3;
///
/// let velocity = Vec3::new(3.0, 4.0, -1.0);
/// assert_eq!(velocity.horizontal().norm(), 5.0);
/// assert_eq!(velocity + Vec3::z() * 2.0, Vec3::new(3.0, 4.0, 1.0));
/// assert_eq!(Vec3::x().cross(&Vec3::y()), Vec3::z());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(from = "[f32; 3]", into = "[f32; 3]"))]
pub struct Vec3 {
    /// Forward in the body frame, north in the world frame.
    pub x: f32,
    /// Right in the body frame, east in the world frame.
    pub y: f32,
    /// Down in both frames.
    pub z: f32,
}

impl Vec3 {
    /// A vector from its components.
    #[inline]
    #[must_use]
    pub const fn new(x: f32, y: f32, z: f32) -> Self {
        Self { x, y, z }
    }

    /// The zero vector.
    #[inline]
    #[must_use]
    pub const fn zeros() -> Self {
        Self::new(0.0, 0.0, 0.0)
    }

    /// A vector with three equal components.
    #[inline]
    #[must_use]
    pub const fn repeat(value: f32) -> Self {
        Self::new(value, value, value)
    }

    /// The unit vector along x.
    #[inline]
    #[must_use]
    pub const fn x() -> Self {
        Self::new(1.0, 0.0, 0.0)
    }

    /// The unit vector along y.
    #[inline]
    #[must_use]
    pub const fn y() -> Self {
        Self::new(0.0, 1.0, 0.0)
    }

    /// The unit vector along z.
    #[inline]
    #[must_use]
    pub const fn z() -> Self {
        Self::new(0.0, 0.0, 1.0)
    }

    /// A vector from a function of the axis, 0 to 2.
    #[inline]
    #[must_use]
    pub fn from_fn(mut number: impl FnMut(usize) -> f32) -> Self {
        Self::new(number(0), number(1), number(2))
    }

    /// The components as an array.
    #[inline]
    #[must_use]
    pub const fn to_array(self) -> [f32; 3] {
        [self.x, self.y, self.z]
    }

    /// Iterates over x, y and z.
    #[inline]
    pub fn iter(&self) -> core::array::IntoIter<&f32, 3> {
        [&self.x, &self.y, &self.z].into_iter()
    }

    /// Iterates mutably over x, y and z.
    #[inline]
    pub fn iter_mut(&mut self) -> core::array::IntoIter<&mut f32, 3> {
        [&mut self.x, &mut self.y, &mut self.z].into_iter()
    }

    /// Applies a function to each component.
    #[inline]
    #[must_use]
    pub fn map(&self, mut function: impl FnMut(f32) -> f32) -> Self {
        Self::new(function(self.x), function(self.y), function(self.z))
    }

    /// Applies a function to each pair of components of the two vectors.
    #[inline]
    #[must_use]
    pub fn zip_map(&self, other: &Self, mut function: impl FnMut(f32, f32) -> f32) -> Self {
        Self::new(function(self.x, other.x), function(self.y, other.y), function(self.z, other.z))
    }

    /// Product of the two vectors, component by component.
    #[inline]
    #[must_use]
    pub fn component_mul(&self, other: &Self) -> Self {
        Self::new(self.x * other.x, self.y * other.y, self.z * other.z)
    }

    /// Quotient of the two vectors, component by component.
    #[inline]
    #[must_use]
    pub fn component_div(&self, other: &Self) -> Self {
        Self::new(self.x / other.x, self.y / other.y, self.z / other.z)
    }

    /// Absolute value of each component.
    #[inline]
    #[must_use]
    pub fn abs(&self) -> Self {
        Self::new(self.x.abs(), self.y.abs(), self.z.abs())
    }

    /// The largest component. Ignores NaN.
    #[inline]
    #[must_use]
    pub const fn max(&self) -> f32 {
        larger(larger(self.x, self.y), self.z)
    }

    /// The smallest component. Ignores NaN.
    #[inline]
    #[must_use]
    pub const fn min(&self) -> f32 {
        smaller(smaller(self.x, self.y), self.z)
    }

    /// The largest absolute value of a component. Ignores NaN.
    #[inline]
    #[must_use]
    pub const fn amax(&self) -> f32 {
        larger(larger(self.x.abs(), self.y.abs()), self.z.abs())
    }

    /// The larger of the two vectors, component by component.
    #[inline]
    #[must_use]
    pub fn sup(&self, other: &Self) -> Self {
        self.zip_map(other, f32::max)
    }

    /// The smaller of the two vectors, component by component.
    #[inline]
    #[must_use]
    pub fn inf(&self, other: &Self) -> Self {
        self.zip_map(other, f32::min)
    }

    /// x + y + z.
    #[inline]
    #[must_use]
    pub const fn sum(&self) -> f32 {
        self.x + self.y + self.z
    }

    /// The vector with z set to zero. Of a velocity in the world frame: the velocity over ground.
    #[inline]
    #[must_use]
    pub const fn horizontal(&self) -> Self {
        Self::new(self.x, self.y, 0.0)
    }

    /// Dot product.
    #[inline]
    #[must_use]
    pub const fn dot(&self, other: &Self) -> f32 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// Cross product.
    #[inline]
    #[must_use]
    pub const fn cross(&self, other: &Self) -> Self {
        Self::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }

    /// Square of the length. Use it for comparisons with a squared limit, because it needs no root.
    #[inline]
    #[must_use]
    pub const fn norm_squared(&self) -> f32 {
        self.dot(self)
    }

    /// Length.
    #[cfg(feature = "math")]
    #[inline]
    #[must_use]
    pub fn norm(&self) -> f32 {
        crate::math::sqrt(self.norm_squared())
    }

    /// The vector scaled to length one. NaN for the zero vector: check the [`norm`](Self::norm)
    /// first.
    #[cfg(feature = "math")]
    #[inline]
    #[must_use]
    pub fn normalize(&self) -> Self {
        *self / self.norm()
    }
}

impl From<[f32; 3]> for Vec3 {
    #[inline]
    fn from([x, y, z]: [f32; 3]) -> Self {
        Self::new(x, y, z)
    }
}

impl From<Vec3> for [f32; 3] {
    #[inline]
    fn from(vector: Vec3) -> Self {
        vector.to_array()
    }
}

impl<'a> IntoIterator for &'a Vec3 {
    type Item = &'a f32;
    type IntoIter = core::array::IntoIter<&'a f32, 3>;

    #[inline]
    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

/// Panics for an axis other than 0, 1 and 2, like an array.
impl Index<usize> for Vec3 {
    type Output = f32;

    #[inline]
    fn index(&self, axis: usize) -> &f32 {
        [&self.x, &self.y, &self.z][axis]
    }
}

/// Panics for an axis other than 0, 1 and 2, like an array.
impl IndexMut<usize> for Vec3 {
    #[inline]
    fn index_mut(&mut self, axis: usize) -> &mut f32 {
        let [x, y, z] = [&mut self.x, &mut self.y, &mut self.z];
        match axis {
            0 => x,
            1 => y,
            2 => z,
            _ => panic!("a vector has three axes"),
        }
    }
}

operator!(Add, add, Vec3, Vec3, Vec3, |a, b| Vec3::new(a.x + b.x, a.y + b.y, a.z + b.z));
operator!(Sub, sub, Vec3, Vec3, Vec3, |a, b| Vec3::new(a.x - b.x, a.y - b.y, a.z - b.z));
operator!(Mul, mul, Vec3, f32, Vec3, |a, b| Vec3::new(a.x * b, a.y * b, a.z * b));
operator!(Mul, mul, f32, Vec3, Vec3, |a, b| b * a);
operator!(Div, div, Vec3, f32, Vec3, |a, b| Vec3::new(a.x / b, a.y / b, a.z / b));

/// Implements an assignment operator.
macro_rules! assignment {
    ($Trait:ident, $function:ident, $Right:ty, $operator:tt) => {
        impl $Trait<$Right> for Vec3 {
            #[inline]
            fn $function(&mut self, right: $Right) {
                *self = *self $operator right;
            }
        }
        impl $Trait<&$Right> for Vec3 {
            #[inline]
            fn $function(&mut self, right: &$Right) {
                *self = *self $operator *right;
            }
        }
    };
}

assignment!(AddAssign, add_assign, Vec3, +);
assignment!(SubAssign, sub_assign, Vec3, -);
assignment!(MulAssign, mul_assign, f32, *);
assignment!(DivAssign, div_assign, f32, /);

impl Neg for Vec3 {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

impl Neg for &Vec3 {
    type Output = Vec3;
    #[inline]
    fn neg(self) -> Vec3 {
        -*self
    }
}

/// Writes (x, y, z) with the formatter's options applied to each component.
impl core::fmt::Display for Vec3 {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("(")?;
        self.x.fmt(f)?;
        f.write_str(", ")?;
        self.y.fmt(f)?;
        f.write_str(", ")?;
        self.z.fmt(f)?;
        f.write_str(")")
    }
}

impl Sum for Vec3 {
    fn sum<I: Iterator<Item = Self>>(vectors: I) -> Self {
        vectors.fold(Self::zeros(), |sum, vector| sum + vector)
    }
}

impl<'a> Sum<&'a Vec3> for Vec3 {
    fn sum<I: Iterator<Item = &'a Self>>(vectors: I) -> Self {
        vectors.copied().sum()
    }
}
