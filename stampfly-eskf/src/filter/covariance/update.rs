//! Innovation, gain and update with a measurement.
//!
//! A measurement of several axes is whitened first, so that scalar updates are exact and no matrix
//! is inverted, and then subtracted in one pass over the covariance.

use super::super::lanes::{Lanes, VECTORS};
use super::{BLOCKS, Covariance, N, Row, add_rows, place};
use stampfly_types::math;

/// Largest share of a variance that rounding may have removed.
const ROUNDING: f32 = 1e-5;
/// Variance of a state about which everything is lost, in its squared unit (m, m/s, rad, …).
const LOST: f32 = 1.0;

/// The whitened innovation of a measurement of `M` axes and its gain.
///
/// The Cholesky factorisation of the innovation covariance, S = L·Lᵀ, makes the axes independent:
/// the innovations become L⁻¹·y with unit variance, and P·Hᵀ becomes P·Hᵀ·L⁻ᵀ. This is the
/// sequential update (Bierman, "Factorization Methods for Discrete Sequential Estimation", 1977,
/// section V.3) without changing P before the measurement has passed its gate.
#[derive(Clone, Copy, Debug)]
pub struct Innovation<const M: usize> {
    /// Square-root gain, the columns of P·Hᵀ·L⁻ᵀ.
    gain: [Row; M],
    /// L⁻¹·y.
    whitened: [f32; M],
}

impl<const M: usize> Innovation<M> {
    /// The whitened innovations: independent and of unit variance if the filter is consistent.
    #[inline]
    #[must_use]
    pub fn whitened(&self) -> &[f32; M] {
        &self.whitened
    }

    /// Correction of each state by the measurement.
    pub(crate) fn correction(&self) -> [f32; N] {
        core::array::from_fn(|state| {
            let (block, axis) = place(state);
            let columns = self.gain.iter().zip(&self.whitened);
            columns.filter_map(|(column, innovation)| Some(column.get(block)?.get(axis) * innovation)).sum()
        })
    }

    /// Normalised innovation squared yᵀ·S⁻¹·y, the squared Mahalanobis distance of the measurement:
    /// χ²-distributed with `M` degrees of freedom if the filter is consistent.
    #[inline]
    #[must_use]
    pub fn nis(&self) -> f32 {
        self.whitened.iter().map(|v| v * v).sum()
    }
}

impl Covariance {
    /// Innovation of a measurement of `M` axes from its Jacobians by the error states, its
    /// innovations, and the noise variance of each axis, which must be positive. Does not change
    /// the covariance. Zero entries of a Jacobian cost almost nothing.
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
            // Models depend on few blocks of three states: skip the others as a whole.
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
            // Decorrelate from the preceding axes.
            let mut innovation = result.whitened[axis];
            for before in 0..axis {
                let earlier = &result.gain[before];
                let shared = dot(earlier);
                add_rows::<0, 1>(&mut column, [-shared], [earlier]);
                innovation -= shared * result.whitened[before];
            }
            let variance = dot(&column) + noise;
            // Rounding may make H·P·Hᵀ slightly negative.
            let scale = 1.0 / math::sqrt(math::larger(variance, noise));
            for (gain, lanes) in result.gain[axis].iter_mut().zip(&column) {
                *gain = lanes.times(scale);
            }
            result.whitened[axis] = innovation * scale;
        }
        result
    }

    /// Updates the covariance with a measurement: P ← P − P·Hᵀ·S⁻¹·H·P, in the square-root form P −
    /// D·Dᵀ with D = P·Hᵀ·L⁻ᵀ. Returns the correction of the error state, for
    /// [`NominalState::correct`](crate::filter::NominalState::correct).
    ///
    /// No variance becomes negative, even if measurements contradict each other. If rounding
    /// removes slightly more than a variance, a hundred-thousandth of it remains, without
    /// covariances. If far more is removed, the covariances were invalid: all of them are dropped
    /// and the correction is zero.
    ///
    /// Must directly follow [`Self::innovation`], because the gain belongs to the covariance at
    /// that moment.
    #[inline]
    pub fn update<const M: usize>(&mut self, innovation: &Innovation<M>) -> [f32; N] {
        self.try_update(innovation).unwrap_or([0.0; N])
    }

    /// The same, but returns `None` if invalid covariances were dropped and the measurement had no
    /// effect.
    #[inline]
    pub fn try_update<const M: usize>(&mut self, innovation: &Innovation<M>) -> Option<[f32; N]> {
        self.update_with::<M, VECTORS>(innovation)
    }

    /// Reverts an update for states that are only considered (Schmidt, "Application of State-Space
    /// Methods to Navigation Problems", 1966): their uncertainty enters the innovation, but neither
    /// they nor their covariance are corrected.
    ///
    /// Must directly follow [`Self::try_update`] with this innovation; `correction` is its result.
    #[inline]
    pub fn consider<const M: usize, const K: usize>(
        &mut self,
        innovation: &Innovation<M>,
        states: [usize; K],
        correction: &mut [f32; N],
    ) {
        // Checked access, free of cost because the states are constants after inlining.
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
            // A correction that is not finite stays visible to the caller's health check.
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
        // A NaN must not reach the covariance. Any NaN makes the sum NaN.
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
        // Test the sign bit of all variances at once, two instructions less per variance than
        // comparisons. A zero variance is raised to its floor by the next propagation.
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

    /// Repairs variances from which this gain has removed more than there was. Returns true if
    /// rounding cannot explain it; the measurement then has no effect.
    #[cold]
    #[inline(never)]
    fn repair(&mut self, gain: &[Row]) -> bool {
        let taken: [f32; N] = core::array::from_fn(|state| {
            let (block, axis) = place(state);
            gain.iter().filter_map(|column| column.get(block)).map(|lanes| lanes.get(axis) * lanes.get(axis)).sum()
        });
        let states = || taken.into_iter().enumerate();
        // An overflow gives NaN, which rounding does not explain either.
        let cannot_be =
            !states().all(|(state, taken)| self.get(state, state) >= -ROUNDING * (self.get(state, state) + taken));
        for (state, taken) in states() {
            let left = self.get(state, state);
            let before = left + taken;
            if cannot_be {
                // The removed part may be so large that the variance before the update cannot be
                // recovered.
                let is_known = before.is_finite() && before > ROUNDING * taken;
                self.reset(state, if is_known { before } else { LOST });
            } else if left <= 0.0 {
                self.reset(state, ROUNDING * before);
            }
        }
        cannot_be
    }
}

/// Subtracts w·wᵀ of each gain column w from the rows of this block: whole rows, or from the
/// diagonal on. The products are the same on both sides of the diagonal.
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
