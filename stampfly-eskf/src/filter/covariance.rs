//! The covariance of the error state: storage, propagation and update, shaped for speed.
//!
//! Five by five blocks of three by three. Where a vector register holds four numbers a row of a block is one, whose last lane
//! stays zero; elsewhere it has three. All operations go block by block, so that the compiler turns each into a
//! few vector instructions on a host and into tight loops on a microcontroller. Propagation uses the
//! block structure of F: of the five block rows three change, and of those the last two block columns change only by the row
//! operation; the other triangle is a mirror of the first. An update of several axes is sequential and scalar, so no
//! matrix is inverted, but it whitens the innovations first and then passes over the matrix
//! once. The matrix stays exactly symmetric by construction: the update subtracts w·wᵀ, the propagation mirrors.

use super::lanes::{Lanes, VECTORS, transposed};
pub use super::layout::N;
use super::propagation::PropagationStep;
use super::state::{Rotation, rotation_matrix};
use stampfly_types::math;

/// Blocks in a row: position, velocity, attitude, gyro bias, accelerometer bias.
const BLOCKS: usize = 5;

type Row = [Lanes; BLOCKS];

/// A symmetric 15 × 15 matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Covariance {
    rows: [[Row; 3]; BLOCKS],
}

/// White noise driving the error state, as variances a second.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ProcessNoise {
    /// Of the velocity: (m/s)²/s.
    pub velocity: f32,
    /// Of the attitude: rad²/s.
    pub attitude: f32,
    /// Of the gyro bias: (rad/s)²/s.
    pub gyro_bias: f32,
    /// Of the accelerometer bias: (m/s²)²/s.
    pub accel_bias: f32,
}

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

    /// Normalised innovation squared yᵀ·S⁻¹·y, the squared Mahalanobis distance of the measurement: χ²-distributed with
    /// `M` degrees of freedom when the filter is consistent.
    #[inline]
    #[must_use]
    pub fn nis(&self) -> f32 {
        self.whitened.iter().map(|v| v * v).sum()
    }
}

/// Smallest variance a state may claim, so that rounding never makes one zero or negative.
const FLOOR: [f32; BLOCKS] = [
    1e-8,  // position, (0.1 mm)²
    1e-8,  // velocity, (0.1 mm/s)²
    1e-9,  // attitude, (0.03 mrad)²
    1e-12, // gyro bias, (1 µrad/s)²
    1e-9,  // accelerometer bias, (0.03 mm/s²)²
];

/// Adds multiples of rows to a row, one after the other, from block `FIRST` on.
// A few vector instructions, or a hundred scalar ones that want to be there once.
#[cfg_attr(target_arch = "x86_64", inline(always))]
#[cfg_attr(not(target_arch = "x86_64"), inline)]
fn add_rows<const FIRST: usize, const K: usize>(to: &mut Row, factors: [f32; K], rows: [&Row; K]) {
    for (block, to) in to.iter_mut().enumerate().skip(FIRST) {
        let mut sum = *to;
        for (factor, row) in factors.into_iter().zip(rows) {
            sum = sum + row[block].times(factor);
        }
        *to = sum;
    }
}

/// Columns of the blocks of F that are neither zero nor a multiple of one.
struct Columns {
    /// Of velocity ← attitude.
    by_attitude: [Lanes; 3],
    /// Of velocity ← accelerometer bias.
    by_bias: [Lanes; 3],
    /// Of attitude ← attitude.
    turn: [Lanes; 3],
    dt: f32,
}

// One row of a block: short where it is a few vector instructions, and there once where it is not.
impl Columns {
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(never))]
    fn push(&self, velocity: &mut Lanes, attitude: &Lanes, accel_bias: &Lanes) {
        let ([x, y, z], [bias_x, bias_y, bias_z]) = (attitude.to_array(), accel_bias.to_array());
        let ([a_x, a_y, a_z], [b_x, b_y, b_z]) = (&self.by_attitude, &self.by_bias);
        *velocity = velocity.plus([x, y, z, bias_x, bias_y, bias_z], [a_x, a_y, a_z, b_x, b_y, b_z]);
    }

    #[cfg_attr(target_arch = "x86_64", inline(always))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(never))]
    fn turn(&self, attitude: &mut Lanes, gyro_bias: &Lanes) {
        let ([x, y, z], [turn_x, turn_y, turn_z]) = (attitude.to_array(), &self.turn);
        *attitude = turn_x.times(x).plus([y, z, -self.dt], [turn_y, turn_z, gyro_bias]);
    }
}

/// Block and place in it of a state.
#[inline(always)]
const fn place(state: usize) -> (usize, usize) {
    (state / 3, state % 3)
}

impl Covariance {
    /// A diagonal matrix from one standard deviation per block: position, velocity, attitude, gyro bias,
    /// accelerometer bias.
    #[inline]
    #[must_use]
    pub fn from_sigmas(sigmas: [f32; 5]) -> Self {
        let mut rows = [[[Lanes::zero(); BLOCKS]; 3]; BLOCKS];
        for (block, (rows, sigma)) in rows.iter_mut().zip(sigmas).enumerate() {
            for (axis, row) in rows.iter_mut().enumerate() {
                row[block].set(axis, sigma * sigma);
            }
        }
        Self { rows }
    }

    /// One element. Out of range is zero.
    #[inline]
    #[must_use]
    pub fn get(&self, row: usize, column: usize) -> f32 {
        let ((i, k), (j, l)) = (place(row), place(column));
        self.rows.get(i).and_then(|rows| rows[k].get(j)).map_or(0.0, |lanes| lanes.get(l))
    }

    /// Changes one element. Out of range there is none.
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

    /// Inflates the variance of one state by `variance`.
    pub fn inflate(&mut self, state: usize, variance: f32) {
        self.change(state, state, |before| before + variance);
    }

    /// Is every element finite and every variance positive?
    #[must_use]
    pub fn is_healthy(&self) -> bool {
        let sum: f32 = self.rows.iter().flatten().flatten().flat_map(|lanes| lanes.to_array()).sum();
        sum.is_finite() && (0..N).all(|state| self.get(state, state) > 0.0)
    }

    /// P ← F·P·Fᵀ + Q over a short step that begins in the attitude `rotation`.
    ///
    /// F = I, plus τ in position ← velocity, −\[s\]×·R in velocity ← attitude, −R·τ in velocity ← accelerometer bias,
    /// ΔRᵀ in attitude ← attitude and −I·τ in attitude ← gyro bias, with τ, s and ΔR of the [`PropagationStep`]. Terms
    /// of second order in τ are left out of the position.
    #[inline]
    pub fn propagate(&mut self, rotation: &Rotation, step: &PropagationStep, noise: &ProcessNoise) {
        let PropagationStep { duration: dt, delta_velocity, .. } = *step;
        let [north, east, down] = rotation;
        let cross = |a: f32, x: &[f32; 3], b: f32, y: &[f32; 3]| {
            [a * x[0] - b * y[0], a * x[1] - b * y[1], a * x[2] - b * y[2]]
        };
        let by_attitude = [
            cross(delta_velocity.z, east, delta_velocity.y, down),
            cross(delta_velocity.x, down, delta_velocity.z, north),
            cross(delta_velocity.y, north, delta_velocity.x, east),
        ];
        let scaled = |[x, y, z]: [f32; 3]| [-dt * x, -dt * y, -dt * z];
        let by_bias = [scaled(*north), scaled(*east), scaled(*down)];
        let turn_back = rotation_matrix(step.delta_rotation);
        let turn = columns(&turn_back);

        // Rows: T = F·P for the nine that change, from the diagonal block on. Each block needs only those after it as they
        // were, so it takes their place.
        let [position, velocity, attitude, gyro_bias, accel_bias] = &mut self.rows;
        for (row, velocity) in position.iter_mut().zip(&*velocity) {
            add_rows::<0, 1>(row, [dt], [velocity]);
        }
        let [x, y, z] = &*attitude;
        let [bias_x, bias_y, bias_z] = &*accel_bias;
        for ((row, a), b) in velocity.iter_mut().zip(&by_attitude).zip(&by_bias) {
            add_rows::<1, 6>(row, [a[0], a[1], a[2], b[0], b[1], b[2]], [x, y, z, bias_x, bias_y, bias_z]);
        }
        let [x, y, z] = *attitude;
        for ((row, c), gyro_bias) in attitude.iter_mut().zip(&turn).zip(&*gyro_bias) {
            *row = [Lanes::zero(); BLOCKS];
            add_rows::<2, 4>(row, [c[0], c[1], c[2], -dt], [&x, &y, &z, gyro_bias]);
        }

        // Columns: the first three blocks of T·Fᵀ, from the diagonal block on; the bias columns of T are already final.
        let as_lanes = |[x, y, z]: Rotation| [Lanes::new(x), Lanes::new(y), Lanes::new(z)];
        let columns = Columns {
            by_attitude: as_lanes(columns(&by_attitude)),
            by_bias: as_lanes(columns(&by_bias)),
            turn: as_lanes(turn_back),
            dt,
        };
        for [p, v, a, gyro_bias, accel_bias] in position {
            *p = p.plus([dt], [v]);
            columns.push(v, a, accel_bias);
            columns.turn(a, gyro_bias);
        }
        for [_, v, a, gyro_bias, accel_bias] in velocity {
            columns.push(v, a, accel_bias);
            columns.turn(a, gyro_bias);
        }
        for [_, _, a, gyro_bias, _] in attitude {
            columns.turn(a, gyro_bias);
        }
        self.mirror::<3>();

        let driving = [0.0, noise.velocity, noise.attitude, noise.gyro_bias, noise.accel_bias];
        for (block, (rows, driving)) in self.rows.iter_mut().zip(driving).enumerate() {
            for (axis, row) in rows.iter_mut().enumerate() {
                let (grown, floor) = (row[block].get(axis) + driving * dt, FLOOR[block]);
                row[block].set(axis, if grown > floor { grown } else { floor });
            }
        }
    }

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
            let scale = 1.0 / math::sqrt(variance.max(noise));
            for (gain, lanes) in result.gain[axis].iter_mut().zip(&column) {
                *gain = lanes.times(scale);
            }
            result.whitened[axis] = innovation * scale;
        }
        result
    }

    /// Updates the covariance with a measurement: P ← P − P·Hᵀ·S⁻¹·H·P, in the square-root form P − D·Dᵀ with
    /// D = P·Hᵀ·L⁻ᵀ. Returns the correction of the error state, which goes to
    /// [`NominalState::correct`](super::NominalState::correct).
    ///
    /// Must follow [`Self::innovation`] directly: its gain is that of the covariance at that moment.
    #[inline]
    pub fn update<const M: usize>(&mut self, innovation: &Innovation<M>) -> [f32; N] {
        self.update_with::<M, VECTORS>(innovation)
    }

    /// Takes an update back for states that are only considered (Schmidt, "Application of State-Space Methods to Navigation Problems",
    /// 1966): what they may be wrong by has counted in the innovation, and the measurement corrects neither them nor their
    /// covariance.
    ///
    /// Must follow [`Self::update`] with this innovation, which returned this correction, directly.
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
    fn update_with<const M: usize, const WHOLE: bool>(&mut self, innovation: &Innovation<M>) -> [f32; N] {
        let Innovation { gain, whitened } = innovation;
        // A NaN must not spread into the covariance: any NaN makes the sum one.
        let sum = gain.iter().flatten().fold(Lanes::zero(), |sum, lanes| sum + *lanes);
        if sum.to_array().iter().sum::<f32>().is_nan() {
            return [f32::NAN; N];
        }
        // The blocks on the diagonal and above, then their mirror: the products are the same on both sides.
        let [position, velocity, attitude, gyro_bias, accel_bias] = &mut self.rows;
        if WHOLE {
            subtract_outer_products::<0, 0, M>(position, gain);
            subtract_outer_products::<1, 0, M>(velocity, gain);
            subtract_outer_products::<2, 0, M>(attitude, gain);
            subtract_outer_products::<3, 0, M>(gyro_bias, gain);
            subtract_outer_products::<4, 0, M>(accel_bias, gain);
        } else {
            subtract_outer_products::<0, 0, M>(position, gain);
            subtract_outer_products::<1, 1, M>(velocity, gain);
            subtract_outer_products::<2, 2, M>(attitude, gain);
            subtract_outer_products::<3, 3, M>(gyro_bias, gain);
            subtract_outer_products::<4, 4, M>(accel_bias, gain);
            self.mirror::<5>();
        }
        let mut correction = [Lanes::zero(); BLOCKS];
        for (column, innovation) in gain.iter().zip(whitened) {
            add_rows::<0, 1>(&mut correction, [*innovation], [column]);
        }
        let [[a, b, c], [d, e, f], [g, h, i], [j, k, l], [m, n, o]] = correction.map(Lanes::to_array);
        [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o]
    }

    /// Copies the upper triangle, which was computed, to the lower one, of the first `COLUMNS` block columns.
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

/// The columns of a matrix in row order.
#[inline(always)]
fn columns([x, y, z]: &Rotation) -> Rotation {
    [[x[0], y[0], z[0]], [x[1], y[1], z[1]], [x[2], y[2], z[2]]]
}

/// Subtracts w·wᵀ of each column w of the gain from the rows of this block, from block `FIRST` on.
#[inline(always)]
fn subtract_outer_products<const BLOCK: usize, const FIRST: usize, const M: usize>(
    rows: &mut [Row; 3],
    gain: &[Row; M],
) {
    for (axis, row) in rows.iter_mut().enumerate() {
        add_rows::<FIRST, M>(row, gain.each_ref().map(|column| -column[BLOCK].get(axis)), gain.each_ref());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::state::NominalState;
    use nalgebra::SMatrix;
    use proptest::prelude::*;
    use stampfly_types::Vec3;

    type Dense = SMatrix<f64, 15, 15>;

    fn dense(p: &Covariance) -> Dense {
        Dense::from_fn(|i, j| f64::from(p.get(i, j)))
    }

    /// The same step in the text book's form, dense and in double precision.
    fn reference(p: &Dense, rotation: &Rotation, step: &PropagationStep, noise: &ProcessNoise) -> Dense {
        let dt = f64::from(step.duration);
        let matrix = |m: &Rotation| nalgebra::Matrix3::from_fn(|i, j| f64::from(m[i][j]));
        let r = matrix(rotation);
        let mut transition = Dense::identity();
        let eye = nalgebra::Matrix3::identity();
        transition.fixed_view_mut::<3, 3>(0, 3).copy_from(&(eye * dt));
        transition
            .fixed_view_mut::<3, 3>(3, 6)
            .copy_from(&-(nalgebra::Vector3::from(step.delta_velocity).map(f64::from).cross_matrix() * r));
        transition.fixed_view_mut::<3, 3>(3, 12).copy_from(&(-r * dt));
        transition.fixed_view_mut::<3, 3>(6, 6).copy_from(&matrix(&rotation_matrix(step.delta_rotation)).transpose());
        transition.fixed_view_mut::<3, 3>(6, 9).copy_from(&(-eye * dt));
        let mut next = transition * p * transition.transpose();
        for i in 0..3 {
            next[(3 + i, 3 + i)] += f64::from(noise.velocity) * dt;
            next[(6 + i, 6 + i)] += f64::from(noise.attitude) * dt;
            next[(9 + i, 9 + i)] += f64::from(noise.gyro_bias) * dt;
            next[(12 + i, 12 + i)] += f64::from(noise.accel_bias) * dt;
        }
        next
    }

    const NOISE: ProcessNoise = ProcessNoise { velocity: 0.09, attitude: 1e-4, gyro_bias: 1e-9, accel_bias: 1e-7 };

    fn scaled_difference(a: &Dense, b: &Dense) -> f64 {
        let mut worst = 0.0f64;
        for i in 0..15 {
            for j in 0..15 {
                let scale = (b[(i, i)] * b[(j, j)]).sqrt();
                worst = worst.max((a[(i, j)] - b[(i, j)]).abs() / scale);
            }
        }
        worst
    }

    fn jacobian(entries: &[(usize, f32)]) -> [f32; N] {
        let mut jacobian = [0.0; N];
        for (state, value) in entries {
            jacobian[*state] = *value;
        }
        jacobian
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]
        #[test]
        fn a_thousand_steps_and_updates_match_the_dense_reference(
            rates in prop::collection::vec((-3f32..3.0, -3f32..3.0, -3f32..3.0, -3f32..3.0), 20),
        ) {
            let mut p = Covariance::from_sigmas([0.1, 0.1, 0.1, 0.01, 0.1]);
            // The other way through the rows, which this machine does not take by itself.
            let mut other = p;
            let mut exact = dense(&p);
            let mut state = NominalState::default();
            for n in 0..1000usize {
                let (x, y, z, a) = rates[n / 50];
                let (rotation, mut step) = (state.rotation(), PropagationStep::default());
                for _ in 0..2 {
                    step.extend(&state.propagate(&Vec3::new(a, -a, -9.8 + z), &Vec3::new(x, y, z), 0.0025));
                }
                exact = reference(&exact, &rotation, &step, &NOISE);
                p.propagate(&rotation, &step, &NOISE);
                other.propagate(&rotation, &step, &NOISE);
                if n % 4 == 0 {
                    let h = [
                        jacobian(&[(0, 0.2), (4, 0.9), (6, a), (7, x), (10, 0.3)]),
                        jacobian(&[(3, 0.7), (4, -0.2), (8, z)]),
                        jacobian(&[(6, 1.0), (7, 0.4), (12, 1.0)]),
                    ];
                    let (y, r) = ([0.1, -0.05, 0.02], [0.01, 0.02, 0.05]);
                    let dense_h = SMatrix::<f64, 3, 15>::from_fn(|i, j| f64::from(h[i][j]));
                    let noise = nalgebra::Matrix3::from_diagonal(&nalgebra::Vector3::from(r.map(f64::from)));
                    let innovation = nalgebra::Vector3::from(y.map(f64::from));
                    let s = (dense_h * exact * dense_h.transpose() + noise).try_inverse().unwrap();
                    let gain = exact * dense_h.transpose() * s;

                    let whitened = p.innovation(&h, y, r);
                    let distance = (innovation.transpose() * s * innovation)[0];
                    prop_assert!((f64::from(whitened.nis()) / distance - 1.0).abs() < 1e-2);
                    let correction = p.update_with::<3, true>(&whitened);
                    prop_assert_eq!(correction, other.update_with::<3, false>(&whitened));
                    for (i, (ours, theirs)) in correction.iter().zip((gain * innovation).iter()).enumerate() {
                        let sigma = exact[(i, i)].sqrt();
                        prop_assert!((f64::from(*ours) - theirs).abs() < 5e-3 * sigma, "{i}: {ours}, not {theirs}");
                    }
                    exact -= gain * dense_h * exact;
                }
            }
            prop_assert!(scaled_difference(&dense(&p), &exact) < 2e-3, "{}", scaled_difference(&dense(&p), &exact));
            for i in 0..15 { for j in 0..15 { prop_assert_eq!(p.get(i, j).to_bits(), p.get(j, i).to_bits()) } }
            for i in 0..15 { for j in 0..15 { prop_assert_eq!(p.get(i, j).to_bits(), other.get(i, j).to_bits()) } }
            prop_assert!(p.is_healthy());
            prop_assert!(dense(&p).cholesky().is_some(), "positive definite");
        }
    }

    #[test]
    fn considered_states_stay_and_the_rest_is_josephs_form_without_their_gain() {
        let mut p = Covariance::from_sigmas([0.1, 0.5, 0.1, 0.01, 3.0]);
        let mut state = NominalState::default();
        for _ in 0..40 {
            let (rotation, mut step) = (state.rotation(), PropagationStep::default());
            step.extend(&state.propagate(&Vec3::new(1.0, 0.0, -9.0), &Vec3::new(0.3, 1.0, 0.0), 0.005));
            p.propagate(&rotation, &step, &NOISE);
        }
        let before = p;
        let considered = [2, 5, 14];
        let h = [jacobian(&[(3, 0.9), (5, 0.4), (7, 1.0)]), jacobian(&[(4, 1.0), (5, -0.1), (6, -1.0)])];
        let (y, r) = ([0.3, -0.2], [0.01, 0.02]);
        let innovation = p.innovation(&h, y, r);
        let mut correction = p.update(&innovation);
        p.consider(&innovation, considered, &mut correction);

        let exact = dense(&before);
        let h = SMatrix::<f64, 2, 15>::from_fn(|i, j| f64::from(h[i][j]));
        let noise = nalgebra::Matrix2::from_diagonal(&nalgebra::Vector2::from(r.map(f64::from)));
        let mut gain = exact * h.transpose() * (h * exact * h.transpose() + noise).try_inverse().unwrap();
        for state in considered {
            gain.row_mut(state).fill(0.0);
        }
        let left = Dense::identity() - gain * h;
        let joseph = left * exact * left.transpose() + gain * noise * gain.transpose();
        assert!(scaled_difference(&dense(&p), &joseph) < 1e-4, "{}", scaled_difference(&dense(&p), &joseph));
        let expected = gain * nalgebra::Vector2::from(y.map(f64::from));
        for (i, (ours, theirs)) in correction.iter().zip(expected.iter()).enumerate() {
            assert!((f64::from(*ours) - theirs).abs() < 1e-4, "{i}: {ours}, not {theirs}");
        }
        assert!(considered.iter().all(|i| correction[*i] == 0.0));
        let innovation = p.innovation(&[[f32::NAN; N]], [0.0], [1.0]);
        let mut broken = p.update(&innovation);
        p.consider(&innovation, considered, &mut broken);
        assert!(broken.iter().all(|value| value.is_nan()), "and is not hidden");
    }

    #[test]
    fn reset_clears_the_covariances_of_the_state() {
        let mut p = Covariance::from_sigmas([1.0; 5]);
        p.update(&p.innovation(&[jacobian(&[(0, 1.0), (3, 1.0)])], [0.0], [0.1]));
        assert!(p.get(0, 3) != 0.0);
        p.reset(3, 4.0);
        assert_eq!((p.get(0, 3), p.get(3, 0), p.get(3, 3)), (0.0, 0.0, 4.0));
    }
}
