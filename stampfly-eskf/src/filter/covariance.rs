//! Covariance of the error state in block storage.
//!
//! Five by five blocks of three by three, whose rows are `Lanes`. All operations go block by block,
//! so that the compiler emits a few vector instructions per block on a host and tight loops on a
//! microcontroller. The matrix is exactly symmetric by construction: the update subtracts w·wᵀ, the
//! propagation mirrors one triangle.
//!
//! | file | content |
//! |---|---|
//! | `covariance.rs` | storage, single elements |
//! | `covariance/propagate.rs` | F·P·Fᵀ + Q over a short step |
//! | `covariance/update.rs` | innovation, gain and update with a measurement |

mod propagate;
#[cfg(test)]
mod tests;
mod update;

use super::lanes::{Lanes, transposed};
pub use super::layout::N;
pub use propagate::ProcessNoise;
pub use update::Innovation;

/// Blocks per row: position, velocity, attitude, gyro bias, accelerometer bias.
const BLOCKS: usize = 5;

type Row = [Lanes; BLOCKS];

/// A symmetric 15 × 15 matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Covariance {
    rows: [[Row; 3]; BLOCKS],
}

/// Adds multiples of rows to a row, in sequence, from block `FIRST` on. The fixed order keeps the
/// result bit-identical on all machines.
// Inlined where it is a few vector instructions; one shared copy where it is a hundred scalar ones.
#[cfg_attr(any(target_arch = "x86_64", target_arch = "aarch64"), inline(always))]
#[cfg_attr(not(any(target_arch = "x86_64", target_arch = "aarch64")), inline)]
fn add_rows<const FIRST: usize, const K: usize>(to: &mut Row, factors: [f32; K], rows: [&Row; K]) {
    for (block, to) in to.iter_mut().enumerate().skip(FIRST) {
        let mut sum = *to;
        // Not `Lanes::plus`: collecting the block of each row would compile to a call.
        for (factor, row) in factors.into_iter().zip(rows) {
            // Always `Some`; `if let` avoids a bounds check with a panic at every optimisation
            // level.
            if let Some(lanes) = row.get(block) {
                sum = sum + lanes.times(factor);
            }
        }
        *to = sum;
    }
}

/// Block of a state and its index in that block.
#[inline(always)]
const fn place(state: usize) -> (usize, usize) {
    (state / 3, state % 3)
}

impl Covariance {
    /// A diagonal matrix from one standard deviation per block: position, velocity, attitude, gyro
    /// bias, accelerometer bias.
    #[inline]
    #[must_use]
    pub fn from_sigmas(sigmas: [f32; 5]) -> Self {
        let mut covariance = Self { rows: [[[Lanes::zero(); BLOCKS]; 3]; BLOCKS] };
        covariance.set_sigmas(sigmas);
        covariance
    }

    /// Does in place what [`from_sigmas`](Self::from_sigmas) does; all covariances become zero.
    pub(crate) fn set_sigmas(&mut self, sigmas: [f32; 5]) {
        for (block, (rows, sigma)) in self.rows.iter_mut().zip(sigmas).enumerate() {
            for (axis, row) in rows.iter_mut().enumerate() {
                row.fill(Lanes::zero());
                row[block].set(axis, sigma * sigma);
            }
        }
    }

    /// One element. Zero for an index out of range.
    #[inline]
    #[must_use]
    pub fn get(&self, row: usize, column: usize) -> f32 {
        let ((i, k), (j, l)) = (place(row), place(column));
        self.rows.get(i).and_then(|rows| rows[k].get(j)).map_or(0.0, |lanes| lanes.get(l))
    }

    /// Changes one element. Ignored for an index out of range.
    #[inline(always)]
    fn change(&mut self, row: usize, column: usize, change: impl FnOnce(f32) -> f32) {
        let ((i, k), (j, l)) = (place(row), place(column));
        if let Some(lanes) = self.rows.get_mut(i).and_then(|rows| rows[k].get_mut(j)) {
            lanes.set(l, change(lanes.get(l)));
        }
    }

    /// Replaces the variance of one state and sets its covariances to zero.
    pub fn reset(&mut self, state: usize, variance: f32) {
        for other in 0..N {
            let value = if other == state { variance } else { 0.0 };
            self.change(state, other, |_| value);
            self.change(other, state, |_| value);
        }
    }

    /// Adds `variance` to the variance of one state.
    pub fn inflate(&mut self, state: usize, variance: f32) {
        self.change(state, state, |before| before + variance);
    }

    /// The diagonal.
    #[inline(always)]
    fn variances(&self) -> impl Iterator<Item = f32> {
        self.rows.iter().enumerate().flat_map(|(block, rows)| {
            rows.iter().enumerate().filter_map(move |(axis, row)| Some(row.get(block)?.get(axis)))
        })
    }

    /// Whether every element is finite and no variance is negative.
    #[inline(never)]
    #[must_use]
    pub fn is_healthy(&self) -> bool {
        // Any NaN or infinity makes the sum not finite.
        let sum: f32 = self.rows.iter().flatten().flatten().flat_map(|lanes| lanes.to_array()).sum();
        sum.is_finite() && self.variances().all(|variance| variance >= 0.0)
    }

    /// Copies the upper triangle to the lower one, for the first `COLUMNS` block columns.
    #[inline(always)]
    fn mirror<const COLUMNS: usize>(&mut self) {
        for i in 0..COLUMNS {
            let (above, below) = self.rows.split_at_mut(i + 1);
            let Some([x, y, z]) = above.last_mut() else { return };
            for (rows, ((x, y), z)) in below.iter_mut().zip(x.iter().zip(&*y).zip(&*z).skip(i + 1)) {
                for (row, lanes) in rows.iter_mut().zip(transposed([*x, *y, *z])) {
                    row[i] = lanes;
                }
            }
            let ([_, xy, xz], [_, _, yz]) = (x[i].to_array(), y[i].to_array());
            y[i].set(0, xy);
            z[i].set(0, xz);
            z[i].set(1, yz);
        }
    }
}
