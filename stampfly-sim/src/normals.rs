//! Normal variates generated in blocks, for models that use thousands of them.
//!
//! [`Normals`] gives the same numbers as [`Noise::normal`], bit for bit. In a block, the latencies
//! of logarithm, division and square root overlap, and a pair that the polar method rejects is
//! overwritten instead of branched around. Not for a model that draws uniform numbers after its
//! first normal one, because a block takes values from the stream ahead of use.

use crate::noise::Noise;

/// Pairs per block.
const PAIRS: usize = 32;
const LENGTH: usize = 2 * PAIRS;

/// The remainder of a random stream as normal variates.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Normals {
    noise: Noise,
    made: [f64; LENGTH],
    /// Number of values of `made` already returned.
    given: usize,
}

impl From<Noise> for Normals {
    fn from(mut noise: Noise) -> Self {
        let (mut made, mut given) = ([0.0; LENGTH], LENGTH);
        // The second variate of a pair already drawn from `noise` comes first, to keep its
        // sequence.
        if let (Some(spare), Some(last)) = (noise.take_spare(), made.last_mut()) {
            *last = spare;
            given -= 1;
        }
        Self { noise, made, given }
    }
}

impl Normals {
    /// The next `N` variates.
    #[inline]
    pub(crate) fn next<const N: usize>(&mut self) -> [f64; N] {
        if let Some(next) = self.made.get(self.given..).and_then(<[f64]>::first_chunk) {
            self.given += N;
            return *next;
        }
        core::array::from_fn(|_| self.one())
    }

    fn one(&mut self) -> f64 {
        if self.given == LENGTH {
            self.make();
        }
        self.given += 1;
        self.made[self.given - 1]
    }

    #[inline(never)]
    fn make(&mut self) {
        let (mut x, mut y, mut squares) = ([0.0; PAIRS], [0.0; PAIRS], [0.0; PAIRS]);
        let mut found = 0;
        while found < PAIRS {
            let point = self.noise.point();
            (x[found], y[found], squares[found]) = (point.x, point.y, point.square);
            // A rejected point is overwritten by the next one; no branch is needed.
            found += usize::from(point.is_inside());
        }
        // Same operations as in `Point::normals`.
        let scales = squares.map(|square| (-2.0 * log_below_one(square) / square).sqrt());
        for (pair, ((x, y), scale)) in self.made.as_chunks_mut().0.iter_mut().zip(x.iter().zip(&y).zip(&scales)) {
            *pair = [x * scale, y * scale];
        }
        self.given = 0;
    }
}

/// [`libm::log`] of a normal number between 0 and 1, both exclusive: the same operations in the
/// same order without the branches for other numbers, so that the compiler can vectorise it.
///
/// The polynomials are those of fdlibm (Sun Microsystems, `e_log.c`, 1993), as in libm.
#[inline]
fn log_below_one(x: f64) -> f64 {
    const LN2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
    const ODD: [f64; 4] =
        [6.666_666_666_666_735e-1, 2.857_142_874_366_239e-1, 1.818_357_216_161_805e-1, 1.479_819_860_511_658_6e-1];
    const EVEN: [f64; 3] = [3.999_999_999_940_942e-1, 2.222_219_843_214_978_4e-1, 1.531_383_769_920_937_3e-1];
    /// Upper half of the bits of √½.
    const ROOT: u64 = 0x3fe6_a09e << 32;
    const ONE: u64 = 0x3ff0_0000 << 32;
    /// 2⁵²: an f64 of this size has no fraction, so an integer placed in the mantissa is its value.
    const WHOLE: f64 = 4_503_599_627_370_496.0;

    // x = 2ᵏ·(1 + f), with 1 + f from √½ to √2.
    let bits = x.to_bits().wrapping_add(ONE - ROOT);
    let k = f64::from_bits((bits >> 52) | WHOLE.to_bits()) - (WHOLE + 1023.0);
    let f = f64::from_bits((bits & 0x000f_ffff_ffff_ffff) + ROOT) - 1.0;
    let half_square = 0.5 * f * f;
    let s = f / (2.0 + f);
    let z = s * s;
    let w = z * z;
    let even = w * (EVEN[0] + w * (EVEN[1] + w * EVEN[2]));
    let odd = z * (ODD[0] + w * (ODD[1] + w * (ODD[2] + w * ODD[3])));
    s * (half_square + (odd + even)) + k * LN2[1] - half_square + f + k * LN2[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_logarithm_is_libms() {
        let mut noise = Noise::new(3, 9);
        // Smallest and largest square of an accepted point, and the surroundings of a change of k.
        let edges = [
            2f64.powi(-62),
            1.0 - f64::EPSILON / 2.0,
            0.5f64.sqrt().next_down(),
            0.5f64.sqrt(),
            0.5f64.sqrt().next_up(),
        ];
        let anywhere = (0..300_000).map(|_| noise.unit() * libm::exp2(-62.0 * noise.unit())).filter(|x| *x > 0.0);
        for x in anywhere.chain(edges) {
            assert_eq!(log_below_one(x).to_bits(), libm::log(x).to_bits(), "{x:e}");
        }
    }

    #[test]
    fn many_at_a_time_are_the_same_as_one_by_one() {
        for before in 0..3 {
            let mut noise = Noise::new(11, 5);
            (0..before).for_each(|_| _ = (noise.unit(), noise.normal()));
            let mut normals = Normals::from(noise.clone());
            for _ in 0..20_000 {
                let (many, [one]) = (normals.next::<6>(), normals.next());
                let expected: [f64; 7] = core::array::from_fn(|_| noise.normal());
                assert_eq!([&many[..], &[one]].concat(), expected, "after {before}");
            }
        }
    }
}
