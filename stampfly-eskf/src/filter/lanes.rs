//! Three numbers: a row of a 3 × 3 block, in a vector register where available.
//!
//! On x86-64 and AArch64 they are a register of four whose last lane stays zero. Without it, an
//! auto-vectorising compiler joins two rows where registers are wider, then reads in halves what
//! was just written and stalls on it (four times slower with `target-cpu=native`). Elsewhere they
//! are an array of three. Both give the same bits: the order of sums is fixed and no multiplication
//! is fused with an addition.
//!
//! Only for the covariance. Vectors of the estimate are [`Vec3`](stampfly_types::Vec3).

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
pub use array::Lanes;
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
pub use register::Lanes;

/// Whether vector registers are used. A whole row then costs less than the half of it that is
/// needed.
pub const VECTORS: bool = cfg!(any(target_arch = "x86_64", target_arch = "aarch64"));

impl Lanes {
    /// Lane 0 to 2; zero for others.
    #[inline(always)]
    pub fn get(self, lane: usize) -> f32 {
        self.to_array().get(lane).copied().unwrap_or(0.0)
    }

    /// Replaces a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, value: f32) {
        let mut all = self.to_array();
        if let Some(cell) = all.get_mut(lane) {
            *cell = value;
        }
        *self = Self::new(all);
    }

    /// Adds multiples of other rows, in sequence.
    #[inline(always)]
    pub fn plus<const K: usize>(self, factors: [f32; K], others: [&Self; K]) -> Self {
        factors.into_iter().zip(others).fold(self, |sum, (factor, other)| sum + other.times(factor))
    }
}

/// The transposed block.
#[inline(always)]
pub fn transposed(rows: [Lanes; 3]) -> [Lanes; 3] {
    let ([a, b, c], [d, e, f], [g, h, i]) = (rows[0].to_array(), rows[1].to_array(), rows[2].to_array());
    [Lanes::new([a, d, g]), Lanes::new([b, e, h]), Lanes::new([c, f, i])]
}

impl From<[f32; 3]> for Lanes {
    fn from(values: [f32; 3]) -> Self {
        Self::new(values)
    }
}

impl From<Lanes> for [f32; 3] {
    fn from(lanes: Lanes) -> Self {
        lanes.to_array()
    }
}

impl PartialEq for Lanes {
    fn eq(&self, other: &Self) -> bool {
        self.to_array() == other.to_array()
    }
}

impl core::fmt::Debug for Lanes {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.to_array().fmt(f)
    }
}

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
mod register {
    use wide::f32x4;

    /// See the [module](super) documentation.
    #[derive(Clone, Copy)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    #[cfg_attr(feature = "serde", serde(from = "[f32; 3]", into = "[f32; 3]"))]
    pub struct Lanes(f32x4);

    impl Lanes {
        /// All lanes zero.
        #[inline(always)]
        pub fn zero() -> Self {
            Self(f32x4::ZERO)
        }

        /// From an array.
        #[inline(always)]
        pub fn new([x, y, z]: [f32; 3]) -> Self {
            Self(f32x4::new([x, y, z, 0.0]))
        }

        /// To an array.
        #[inline(always)]
        pub fn to_array(self) -> [f32; 3] {
            let [x, y, z, _] = self.0.to_array();
            [x, y, z]
        }

        /// Multiple by a scalar.
        #[inline(always)]
        pub fn times(self, factor: f32) -> Self {
            Self(f32x4::splat(factor) * self.0)
        }
    }

    impl core::ops::Add for Lanes {
        type Output = Self;

        #[inline(always)]
        fn add(self, other: Self) -> Self {
            Self(self.0 + other.0)
        }
    }
}

#[cfg(any(test, not(any(target_arch = "x86_64", target_arch = "aarch64"))))]
mod array {
    /// See the [module](super) documentation.
    #[derive(Clone, Copy)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    #[cfg_attr(feature = "serde", serde(transparent))]
    pub struct Lanes([f32; 3]);

    impl Lanes {
        /// All lanes zero.
        #[inline(always)]
        pub fn zero() -> Self {
            Self([0.0; 3])
        }

        /// From an array.
        #[inline(always)]
        pub fn new(values: [f32; 3]) -> Self {
            Self(values)
        }

        /// To an array.
        #[inline(always)]
        pub fn to_array(self) -> [f32; 3] {
            self.0
        }

        /// Multiple by a scalar.
        #[inline(always)]
        pub fn times(mut self, factor: f32) -> Self {
            for lane in &mut self.0 {
                *lane *= factor;
            }
            self
        }
    }

    impl core::ops::Add for Lanes {
        type Output = Self;

        #[inline(always)]
        fn add(mut self, other: Self) -> Self {
            for (lane, value) in self.0.iter_mut().zip(other.0) {
                *lane += value;
            }
            self
        }
    }
}

#[cfg(all(test, any(target_arch = "x86_64", target_arch = "aarch64")))]
mod tests {
    use super::{array, register};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn array_and_register_give_the_same_bits(a in any::<[f32; 3]>(), b in any::<[f32; 3]>(), factor in any::<f32>()) {
            let one = register::Lanes::new(a) + register::Lanes::new(b).times(factor);
            let other = array::Lanes::new(a) + array::Lanes::new(b).times(factor);
            // NaN has many bit patterns: compare them as one.
            let bits = |lanes: [f32; 3]| lanes.map(|v| if v.is_nan() { u32::MAX } else { v.to_bits() });
            prop_assert_eq!(bits(one.to_array()), bits(other.to_array()));
            prop_assert_eq!(bits(register::Lanes::zero().to_array()), bits(array::Lanes::zero().to_array()));
        }
    }
}
