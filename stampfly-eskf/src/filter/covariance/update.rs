//! Innovation, gain and update with a measurement.
//!
//! An update of several axes is sequential and scalar, so no matrix is inverted, but it whitens the innovations first and then passes over the
//! matrix once.

use super::super::lanes::{Lanes, VECTORS};
use super::{BLOCKS, Covariance, N, Row, add_rows, place};
use stampfly_types::math;

/// Share of a variance that rounding may make of what an update leaves of it.
const ROUNDING: f32 = 1e-5;
/// Variance of a state of which nothing is known any more, in its squared unit: a metre, a metre a second, a radian and so on.
const LOST: f32 = 1.0;

/// The innovation of a measurement of `M` axes, whitened, and the gain that goes with it.
///
/// The axes are made independent by a Cholesky factorisation of their innovation covariance S = L·Lᵀ: the innovations
/// become L⁻¹·y, each of variance one, and P·Hᵀ becomes P·Hᵀ·L⁻ᵀ. This is the sequential update (Bierman,
/// "Factorization Methods for Discrete Sequential Estimation", 1977, section V.3) without touching P before the
/// measurement has passed its gate.
#[derive(Clone, Copy, Debug)]
pub struct Innovation<const M: usize> {
    /// Square-root gain, the columns of P·Hᵀ·L⁻ᵀ.
    gain: [Row; M],
    /// L⁻¹·y.
    whitened: [f32; M],
}

impl<const M: usize> Innovation<M> {
    /// The whitened innovations: independent of each other and each of variance one when the filter is consistent.
    #[inline]
    #[must_use]
    pub fn whitened(&self) -> &[f32; M] {
        &self.whitened
    }

    /// How far the measurement moves each state.
    pub(crate) fn correction(&self) -> [f32; N] {
        core::array::from_fn(|state| {
            let (block, axis) = place(state);
            let columns = self.gain.iter().zip(&self.whitened);
            columns.filter_map(|(column, innovation)| Some(column.get(block)?.get(axis) * innovation)).sum()
        })
    }

    /// Normalised innovation squared yᵀ·S⁻¹·y, the squared Mahalanobis distance of the measurement: χ²-distributed with
    /// `M` degrees of freedom when the filter is consistent.
    #[inline]
    #[must_use]
    pub fn nis(&self) -> f32 {
        self.whitened.iter().map(|v| v * v).sum()
    }
}

impl Covariance {
    /// The innovation of a measurement of `M` axes from its Jacobians by the error states, its innovations, and the
    /// variance of each axis' noise, which must be positive. The covariance stays as it is. Entries of a Jacobian that
    /// are zero cost next to nothing.
    #[inline]
    #[must_use]
    pub fn innovation<const M: usize>(
        &self,
        jacobians: &[[f32; N]; M],
        innovations: [f32; M],
        variances: [f32; M],
    ) -> Innovation<M> {
        let mut result = Innovation { gain: [[Lanes::zero(); BLOCKS]; M], whitened: innovations };
        for (axis, (jacobian, noise)) in jacobians.iter().zip(variances).enumerate() {
            // Models touch few blocks of three states: the others are skipped whole.
            let blocks = jacobian.as_chunks::<3>().0;
            let dot = |row: &Row| {
                let mut sum = 0.0;
                for ([a, b, c], lanes) in blocks.iter().zip(row) {
                    if *a != 0.0 || *b != 0.0 || *c != 0.0 {
                        let [x, y, z] = lanes.to_array();
                        sum += a * x + b * y + c * z;
                    }
                }
                sum
            };
            let mut column = [Lanes::zero(); BLOCKS];
            for ([a, b, c], [x, y, z]) in blocks.iter().zip(&self.rows) {
                if *a != 0.0 || *b != 0.0 || *c != 0.0 {
                    add_rows::<0, 3>(&mut column, [*a, *b, *c], [x, y, z]);
                }
            }
            // Decorrelate from the axes before it.
            let mut innovation = result.whitened[axis];
            for before in 0..axis {
                let earlier = &result.gain[before];
                let shared = dot(earlier);
                add_rows::<0, 1>(&mut column, [-shared], [earlier]);
                innovation -= shared * result.whitened[before];
            }
            let variance = dot(&column) + noise;
            let scale = 1.0 / math::sqrt(math::larger(variance, noise));
            for (gain, lanes) in result.gain[axis].iter_mut().zip(&column) {
                *gain = lanes.times(scale);
            }
            result.whitened[axis] = innovation * scale;
        }
        result
    }

    /// Updates the covariance with a measurement: P ← P − P·Hᵀ·S⁻¹·H·P, in the square-root form P − D·Dᵀ with
    /// D = P·Hᵀ·L⁻ᵀ. Returns the correction of the error state, which goes to
    /// [`NominalState::correct`](crate::filter::NominalState::correct).
    ///
    /// No variance becomes negative, whatever measurements contradict one another. What is subtracted from one that is all but certain may be more
    /// than there is by its last digit: then a hundred thousandth of it is left, without covariances. Where it is more by far, these
    /// covariances cannot be: all of them are dropped, and the correction is zero.
    ///
    /// Must follow [`Self::innovation`] directly: its gain is that of the covariance at that moment.
    #[inline]
    pub fn update<const M: usize>(&mut self, innovation: &Innovation<M>) -> [f32; N] {
        self.try_update(innovation).unwrap_or([0.0; N])
    }

    /// The same; `None` where covariances that cannot be are dropped, and nothing is learnt.
    #[inline]
    pub fn try_update<const M: usize>(&mut self, innovation: &Innovation<M>) -> Option<[f32; N]> {
        self.update_with::<M, VECTORS>(innovation)
    }

    /// Takes an update back for states that are only considered (Schmidt, "Application of State-Space Methods to Navigation Problems",
    /// 1966): what they may be wrong by has counted in the innovation, and the measurement corrects neither them nor their
    /// covariance.
    ///
    /// Must follow [`Self::try_update`] with this innovation, which returned this correction, directly.
    #[inline]
    pub fn consider<const M: usize, const K: usize>(
        &mut self,
        innovation: &Innovation<M>,
        states: [usize; K],
        correction: &mut [f32; N],
    ) {
        // Checked, and free where the states are constants: they are inlined.
        let part = |column: &Row, state: usize| {
            let (block, axis) = place(state);
            column.get(block).map_or(0.0, |lanes| lanes.get(axis))
        };
        for i in states {
            for column in &innovation.gain {
                let of = part(column, i);
                for j in states {
                    self.change(i, j, |before| before + of * part(column, j));
                }
            }
            // What is no number stays to be seen.
            if let Some(cell) = correction.get_mut(i).filter(|cell| cell.is_finite()) {
                *cell = 0.0;
            }
        }
    }

    #[inline]
    pub(super) fn update_with<const M: usize, const WHOLE: bool>(
        &mut self,
        innovation: &Innovation<M>,
    ) -> Option<[f32; N]> {
        let Innovation { gain, whitened } = innovation;
        // A NaN must not spread into the covariance: any NaN makes the sum one.
        let sum = gain.iter().flatten().fold(Lanes::zero(), |sum, lanes| sum + *lanes);
        if sum.to_array().iter().sum::<f32>().is_nan() {
            return Some([f32::NAN; N]);
        }
        let [position, velocity, attitude, gyro_bias, accel_bias] = &mut self.rows;
        subtract_outer_products::<0, WHOLE, M>(position, gain);
        subtract_outer_products::<1, WHOLE, M>(velocity, gain);
        subtract_outer_products::<2, WHOLE, M>(attitude, gain);
        subtract_outer_products::<3, WHOLE, M>(gyro_bias, gain);
        subtract_outer_products::<4, WHOLE, M>(accel_bias, gain);
        if !WHOLE {
            self.mirror::<BLOCKS>();
        }
        // Bits instead of comparisons, two instructions less for each: the first one of a negative number is set. One that is zero is lifted to
        // its floor in the next step.
        if self.variances().fold(0, |bits, variance| bits | variance.to_bits()) > i32::MAX as u32 && self.repair(gain) {
            return None;
        }
        let mut correction = [Lanes::zero(); BLOCKS];
        for (column, innovation) in gain.iter().zip(whitened) {
            add_rows::<0, 1>(&mut correction, [*innovation], [column]);
        }
        let [[a, b, c], [d, e, f], [g, h, i], [j, k, l], [m, n, o]] = correction.map(Lanes::to_array);
        Some([a, b, c, d, e, f, g, h, i, j, k, l, m, n, o])
    }

    /// Replaces variances of which this gain has taken more than there was. Was it more than rounding can take? Then nothing has been learnt.
    // Hardly ever, and one for all numbers of axes.
    #[cold]
    #[inline(never)]
    fn repair(&mut self, gain: &[Row]) -> bool {
        let taken: [f32; N] = core::array::from_fn(|state| {
            let (block, axis) = place(state);
            gain.iter().filter_map(|column| column.get(block)).map(|lanes| lanes.get(axis) * lanes.get(axis)).sum()
        });
        let states = || taken.into_iter().enumerate();
        // What has overflowed is no number, and that is not rounding either.
        let cannot_be =
            !states().all(|(state, taken)| self.get(state, state) >= -ROUNDING * (self.get(state, state) + taken));
        for (state, taken) in states() {
            let left = self.get(state, state);
            let before = left + taken;
            if cannot_be {
                // So much may have been taken that what there was is lost.
                let is_known = before.is_finite() && before > ROUNDING * taken;
                self.reset(state, if is_known { before } else { LOST });
            } else if left <= 0.0 {
                self.reset(state, ROUNDING * before);
            }
        }
        cannot_be
    }
}

/// Subtracts w·wᵀ of each column w of the gain from the rows of this block: from all of them, or from the diagonal on. The products
/// are the same on both sides of it.
#[inline(always)]
fn subtract_outer_products<const BLOCK: usize, const WHOLE: bool, const M: usize>(
    rows: &mut [Row; 3],
    gain: &[Row; M],
) {
    for (axis, row) in rows.iter_mut().enumerate() {
        let factors = gain.each_ref().map(|column| -column[BLOCK].get(axis));
        if WHOLE {
            add_rows::<0, M>(row, factors, gain.each_ref());
        } else {
            add_rows::<BLOCK, M>(row, factors, gain.each_ref());
        }
    }
}
