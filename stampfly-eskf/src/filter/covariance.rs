//! The covariance of the error state: storage, propagation and the scalar update, shaped for speed.
//!
//! Rows are sixteen wide (the last column stays zero), so every operation runs over whole rows and the compiler
//! turns them into vector instructions on a host and into tight loops on a microcontroller. Propagation uses the
//! block structure of F: of the fifteen rows nine change, and of those the last six columns change only by the row
//! operation. Updates are sequential and scalar: a measurement is a handful of numbers, no matrix is inverted. The
//! matrix stays exactly symmetric by construction: the update subtracts w·wᵀ, the propagation mirrors one triangle.

use super::state::Motion;
use super::{ACCEL_BIAS, ATTITUDE, GYRO_BIAS, POSITION, VELOCITY};
use stampfly_types::math;

/// Number of error states.
pub const N: usize = 15;
/// Width of a stored row.
const WIDTH: usize = 16;

type Row = [f32; WIDTH];

/// A symmetric 15 × 15 matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Covariance {
    rows: [Row; N],
}

/// White noise driving the error state, as variances a second.
#[derive(Clone, Copy, Debug, PartialEq)]
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

/// What a scalar measurement would do to the state: its innovation variance and P·Hᵀ.
#[derive(Clone, Copy, Debug)]
pub struct Projection {
    /// P·Hᵀ.
    ph: Row,
    /// Innovation variance H·P·Hᵀ + R.
    pub variance: f32,
}

/// Smallest variance a state may claim, so that rounding never makes one zero or negative.
const FLOOR: [f32; N] = [
    1e-8, 1e-8, 1e-8, // position, (0.1 mm)²
    1e-8, 1e-8, 1e-8, // velocity, (0.1 mm/s)²
    1e-9, 1e-9, 1e-9, // attitude, (0.03 mrad)²
    1e-12, 1e-12, 1e-12, // gyro bias, (1 µrad/s)²
    1e-9, 1e-9, 1e-9, // accelerometer bias, (0.03 mm/s²)²
];

#[inline]
fn combine<const K: usize>(parts: [(f32, &Row); K]) -> Row {
    let mut out = [0.0; WIDTH];
    for (factor, row) in parts {
        for (o, v) in out.iter_mut().zip(row) {
            *o += factor * v;
        }
    }
    out
}

impl Covariance {
    /// A diagonal matrix from one standard deviation per block: position, velocity, attitude, gyro bias,
    /// accelerometer bias.
    #[must_use]
    pub fn from_sigmas(sigmas: [f32; 5]) -> Self {
        let mut rows = [[0.0; WIDTH]; N];
        for (i, row) in rows.iter_mut().enumerate() {
            row[i] = sigmas[i / 3] * sigmas[i / 3];
        }
        Self { rows }
    }

    /// One element. Out of range is zero.
    #[must_use]
    pub fn get(&self, row: usize, column: usize) -> f32 {
        self.rows.get(row).and_then(|r| r.get(column)).copied().unwrap_or(0.0)
    }

    /// Replaces the variance of one state and forgets its correlations.
    pub fn reset(&mut self, state: usize, variance: f32) {
        for (i, row) in self.rows.iter_mut().enumerate() {
            if i == state {
                *row = [0.0; WIDTH];
            }
            if let Some(cell) = row.get_mut(state) {
                *cell = if i == state { variance } else { 0.0 };
            }
        }
    }

    /// Adds to the variance of one state.
    pub fn inflate(&mut self, state: usize, variance: f32) {
        if let Some(cell) = self.rows.get_mut(state).and_then(|row| row.get_mut(state)) {
            *cell += variance;
        }
    }

    /// Is every element finite and every variance positive?
    #[must_use]
    pub fn is_healthy(&self) -> bool {
        let sum: f32 = self.rows.iter().flatten().sum();
        sum.is_finite() && self.rows.iter().enumerate().all(|(i, row)| row[i] > 0.0)
    }

    /// P ← F·P·Fᵀ + Q for one inertial step.
    ///
    /// F = I, plus dt in position ← velocity, −R\[f\]×dt in velocity ← attitude, −R·dt in velocity ← accelerometer
    /// bias, −\[ω\]×dt in attitude ← attitude and −I·dt in attitude ← gyro bias.
    #[inline]
    pub fn propagate(&mut self, motion: &Motion, noise: &ProcessNoise) {
        let Motion { rotation, force, rate, dt } = *motion;
        let mut by_attitude = [[0.0; 3]; 3];
        let mut by_bias = [[0.0; 3]; 3];
        for ((a, b), r) in by_attitude.iter_mut().zip(&mut by_bias).zip(&rotation) {
            // Row of −R[f]×: −(r × f), written out.
            *a = [
                -dt * (r[1] * force.z - r[2] * force.y),
                -dt * (r[2] * force.x - r[0] * force.z),
                -dt * (r[0] * force.y - r[1] * force.x),
            ];
            *b = r.map(|v| -dt * v);
        }
        let (wx, wy, wz) = (rate.x * dt, rate.y * dt, rate.z * dt);
        let turn = [[1.0, wz, -wy], [-wz, 1.0, wx], [wy, -wx, 1.0]];

        // Rows: T = F·P for the nine rows that change.
        let p = &self.rows;
        let mut t = [[0.0; WIDTH]; 9];
        for i in 0..3 {
            t[i] = combine([(1.0, &p[POSITION + i]), (dt, &p[VELOCITY + i])]);
            let (a, b) = (by_attitude[i], by_bias[i]);
            t[3 + i] = combine([
                (1.0, &p[VELOCITY + i]),
                (a[0], &p[ATTITUDE]),
                (a[1], &p[ATTITUDE + 1]),
                (a[2], &p[ATTITUDE + 2]),
                (b[0], &p[ACCEL_BIAS]),
                (b[1], &p[ACCEL_BIAS + 1]),
                (b[2], &p[ACCEL_BIAS + 2]),
            ]);
            let c = turn[i];
            t[6 + i] = combine([
                (c[0], &p[ATTITUDE]),
                (c[1], &p[ATTITUDE + 1]),
                (c[2], &p[ATTITUDE + 2]),
                (-dt, &p[GYRO_BIAS + i]),
            ]);
        }

        // Columns: the first nine of T·Fᵀ; the bias columns of T are already final.
        for (r, t) in t.iter().enumerate() {
            let mut out = *t;
            for i in 0..3 {
                let (a, b, c) = (by_attitude[i], by_bias[i], turn[i]);
                out[i] = t[i] + dt * t[3 + i];
                out[3 + i] =
                    t[3 + i] + a[0] * t[6] + a[1] * t[7] + a[2] * t[8] + b[0] * t[12] + b[1] * t[13] + b[2] * t[14];
                out[6 + i] = c[0] * t[6] + c[1] * t[7] + c[2] * t[8] - dt * t[9 + i];
            }
            self.rows[r] = out;
        }
        // Mirror: the upper triangle is the truth.
        for i in 1..N {
            for j in 0..i.min(9) {
                self.rows[i][j] = self.rows[j][i];
            }
        }
        for i in 0..3 {
            self.rows[VELOCITY + i][VELOCITY + i] += noise.velocity * dt;
            self.rows[ATTITUDE + i][ATTITUDE + i] += noise.attitude * dt;
            self.rows[GYRO_BIAS + i][GYRO_BIAS + i] += noise.gyro_bias * dt;
            self.rows[ACCEL_BIAS + i][ACCEL_BIAS + i] += noise.accel_bias * dt;
        }
    }

    /// Projects a scalar measurement whose row H has `K` entries (state, value), with noise variance `r`.
    #[inline]
    #[must_use]
    pub fn project<const K: usize>(&self, h: [(usize, f32); K], r: f32) -> Projection {
        let ph = combine(h.map(|(state, value)| (value, &self.rows[state])));
        let variance = h.iter().map(|(state, value)| value * ph[*state]).sum::<f32>() + r;
        Projection { ph, variance }
    }

    /// Absorbs a projected measurement: P ← P − P·Hᵀ·S⁻¹·H·P. Returns the correction for this innovation.
    ///
    /// Must follow [`Self::project`] directly; a change of P in between makes the projection stale.
    #[inline]
    pub fn absorb(&mut self, projection: &Projection, innovation: f32) -> [f32; N] {
        let inverse = 1.0 / projection.variance;
        let root = math::sqrt(inverse);
        let w = projection.ph.map(|v| v * root);
        for (i, row) in self.rows.iter_mut().enumerate() {
            let factor = w[i];
            for (cell, v) in row.iter_mut().zip(&w) {
                *cell -= factor * v;
            }
            row[i] = row[i].max(FLOOR[i]);
        }
        let gain = innovation * inverse;
        core::array::from_fn(|i| projection.ph[i] * gain)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::state::Nominal;
    use nalgebra::SMatrix;
    use proptest::prelude::*;
    use stampfly_types::Vec3;

    type Dense = SMatrix<f64, 15, 15>;

    fn dense(p: &Covariance) -> Dense {
        Dense::from_fn(|i, j| f64::from(p.get(i, j)))
    }

    /// The same step in the text book's form, dense and in double precision.
    fn reference(p: &Dense, motion: &Motion, noise: &ProcessNoise) -> Dense {
        let dt = f64::from(motion.dt);
        let r = nalgebra::Matrix3::from_fn(|i, j| f64::from(motion.rotation[i][j]));
        let f = motion.force.map(f64::from).cross_matrix();
        let w = motion.rate.map(f64::from).cross_matrix();
        let mut transition = Dense::identity();
        let eye = nalgebra::Matrix3::identity();
        transition.fixed_view_mut::<3, 3>(0, 3).copy_from(&(eye * dt));
        transition.fixed_view_mut::<3, 3>(3, 6).copy_from(&(-r * f * dt));
        transition.fixed_view_mut::<3, 3>(3, 12).copy_from(&(-r * dt));
        transition.fixed_view_mut::<3, 3>(6, 6).copy_from(&(eye - w * dt));
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

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]
        #[test]
        fn a_thousand_steps_and_updates_match_the_dense_reference(
            rates in prop::collection::vec((-3f32..3.0, -3f32..3.0, -3f32..3.0, -3f32..3.0), 20),
        ) {
            let mut p = Covariance::from_sigmas([0.1, 0.1, 0.1, 0.01, 0.1]);
            let mut exact = dense(&p);
            let mut state = Nominal::default();
            for step in 0..1000usize {
                let (x, y, z, a) = rates[step / 50];
                let motion = state.propagate(&Vec3::new(a, -a, -9.8 + z), &Vec3::new(x, y, z), 0.0025);
                exact = reference(&exact, &motion, &NOISE);
                p.propagate(&motion, &NOISE);
                if step % 4 == 0 {
                    let h = [(0, 0.2), (4, 0.9), (6, a), (7, x), (10, 0.3)];
                    let projection = p.project(h, 0.01);
                    p.absorb(&projection, 0.0);
                    let mut row = SMatrix::<f64, 1, 15>::zeros();
                    for (i, v) in h { row[i] = f64::from(v) }
                    let s = (row * exact * row.transpose())[0] + 0.01;
                    exact -= exact * row.transpose() * row * exact / s;
                }
            }
            prop_assert!(scaled_difference(&dense(&p), &exact) < 2e-3, "{}", scaled_difference(&dense(&p), &exact));
            for i in 0..15 { for j in 0..15 { prop_assert_eq!(p.get(i, j).to_bits(), p.get(j, i).to_bits()) } }
            prop_assert!(p.is_healthy());
            prop_assert!(dense(&p).cholesky().is_some(), "positive definite");
        }
    }

    #[test]
    fn reset_forgets_correlations() {
        let mut p = Covariance::from_sigmas([1.0; 5]);
        let projection = p.project([(0, 1.0), (3, 1.0)], 0.1);
        p.absorb(&projection, 0.0);
        assert!(p.get(0, 3) != 0.0);
        p.reset(3, 4.0);
        assert_eq!((p.get(0, 3), p.get(3, 0), p.get(3, 3)), (0.0, 0.0, 4.0));
    }
}
