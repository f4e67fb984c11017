//! Three numbers side by side: a row of a 3 × 3 block, in a vector register where there is one.
//!
//! The covariance is made of them. On x86-64 they are an SSE register, whose fourth lane stays zero: compilers that find the
//! vectors by themselves join two rows where registers are wider, read what was just written in halves, and wait for it
//! (four times as slow with `target-cpu=native`). Elsewhere they are an array, of four numbers where the compiler has registers for it and of
//! three on a microcontroller. All give the same bits: no sum changes its order, and nothing is fused.
//!
//! Not for vectors of the estimate: those are [`Vec3`](stampfly_types::Vec3).

#[cfg(not(target_arch = "x86_64"))]
pub use array::Lanes;
#[cfg(target_arch = "x86_64")]
pub use register::Lanes;

/// Are there vector registers? Then a whole row costs less than the half of it that is needed.
pub const VECTORS: bool = cfg!(any(target_arch = "x86_64", target_arch = "aarch64"));

impl Lanes {
    /// A number, 0 to 2. Beyond them it is zero.
    #[inline(always)]
    pub fn get(self, lane: usize) -> f32 {
        self.to_array().get(lane).copied().unwrap_or(0.0)
    }

    /// Replaces a number.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, value: f32) {
        let mut all = self.to_array();
        if let Some(cell) = all.get_mut(lane) {
            *cell = value;
        }
        *self = Self::new(all);
    }

    /// Plus multiples of others, one after the other.
    #[inline(always)]
    pub fn plus<const K: usize>(self, factors: [f32; K], others: [&Self; K]) -> Self {
        let mut sum = self;
        for (factor, other) in factors.into_iter().zip(others) {
            sum = sum + other.times(factor);
        }
        sum
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

#[cfg(target_arch = "x86_64")]
mod register {
    use wide::f32x4;

    /// See the [module](super) documentation.
    #[derive(Clone, Copy)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    #[cfg_attr(feature = "serde", serde(from = "[f32; 3]", into = "[f32; 3]"))]
    pub struct Lanes(f32x4);

    impl Lanes {
        /// All zero.
        #[inline(always)]
        pub fn zero() -> Self {
            Self(f32x4::ZERO)
        }

        /// These three.
        #[inline(always)]
        pub fn new([x, y, z]: [f32; 3]) -> Self {
            Self(f32x4::new([x, y, z, 0.0]))
        }

        /// The three.
        #[inline(always)]
        pub fn to_array(self) -> [f32; 3] {
            let [x, y, z, _] = self.0.to_array();
            [x, y, z]
        }

        /// A multiple.
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

#[cfg(not(target_arch = "x86_64"))]
mod array {
    const LANES: usize = if super::VECTORS { 4 } else { 3 };

    /// See the [module](super) documentation.
    #[derive(Clone, Copy)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    #[cfg_attr(feature = "serde", serde(from = "[f32; 3]", into = "[f32; 3]"))]
    pub struct Lanes([f32; LANES]);

    impl Lanes {
        /// All zero.
        #[inline(always)]
        pub fn zero() -> Self {
            Self([0.0; LANES])
        }

        /// These three.
        #[inline(always)]
        pub fn new([x, y, z]: [f32; 3]) -> Self {
            let mut lanes = Self::zero();
            let [a, b, c, ..] = &mut lanes.0;
            (*a, *b, *c) = (x, y, z);
            lanes
        }

        /// The three.
        #[inline(always)]
        pub fn to_array(self) -> [f32; 3] {
            let [x, y, z, ..] = self.0;
            [x, y, z]
        }

        /// A multiple.
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
