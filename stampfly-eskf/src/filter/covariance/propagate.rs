//! Propagation of the covariance over several inertial samples at once.
//!
//! It uses the block structure of F. Of the five block rows three change, and in those the last two
//! block columns change only by the row operation. One triangle is computed and mirrored. Terms of
//! second order in the duration are neglected in the position.

use super::super::lanes::Lanes;
use super::super::propagation::PropagationStep;
use super::super::state::{Rotation, rotation_matrix};
use super::{BLOCKS, Covariance, add_rows};

/// White noise that drives the error state, as variance per second.
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

/// Smallest variance of a state, so that rounding never makes one zero or negative.
const FLOOR: [f32; BLOCKS] = [
    1e-8,  // position, (0.1 mm)²
    1e-8,  // velocity, (0.1 mm/s)²
    1e-9,  // attitude, (0.03 mrad)²
    1e-12, // gyro bias, (1 µrad/s)²
    1e-9,  // accelerometer bias, (0.03 mm/s²)²
];

/// Columns of the blocks of F that are neither zero nor a multiple of the identity.
struct Columns {
    /// Of velocity ← attitude.
    by_attitude: [Lanes; 3],
    /// Of velocity ← accelerometer bias.
    by_bias: [Lanes; 3],
    /// Of attitude ← attitude.
    turn: [Lanes; 3],
    dt: f32,
}

// One row of a block. Inlined where it is a few vector instructions, one shared copy elsewhere.
impl Columns {
    #[cfg_attr(any(target_arch = "x86_64", target_arch = "aarch64"), inline(always))]
    #[cfg_attr(not(any(target_arch = "x86_64", target_arch = "aarch64")), inline(never))]
    fn push(&self, velocity: &mut Lanes, attitude: &Lanes, accel_bias: &Lanes) {
        let ([x, y, z], [bias_x, bias_y, bias_z]) = (attitude.to_array(), accel_bias.to_array());
        let ([a_x, a_y, a_z], [b_x, b_y, b_z]) = (&self.by_attitude, &self.by_bias);
        *velocity = velocity.plus([x, y, z, bias_x, bias_y, bias_z], [a_x, a_y, a_z, b_x, b_y, b_z]);
    }

    #[cfg_attr(any(target_arch = "x86_64", target_arch = "aarch64"), inline(always))]
    #[cfg_attr(not(any(target_arch = "x86_64", target_arch = "aarch64")), inline(never))]
    fn turn(&self, attitude: &mut Lanes, gyro_bias: &Lanes) {
        let ([x, y, z], [turn_x, turn_y, turn_z]) = (attitude.to_array(), &self.turn);
        *attitude = turn_x.times(x).plus([y, z, -self.dt], [turn_y, turn_z, gyro_bias]);
    }
}

impl Covariance {
    /// P ← F·P·Fᵀ + Q over a short step that begins in the attitude `rotation`.
    ///
    /// F = I, plus τ in position ← velocity, −\[s\]×·R in velocity ← attitude, −R·τ in velocity ←
    /// accelerometer bias, ΔRᵀ in attitude ← attitude and −I·τ in attitude ← gyro bias, with τ, s
    /// and ΔR of the [`PropagationStep`]. Terms of second order in τ are neglected in the position.
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

        // Rows: T = F·P for the nine rows that change, from the diagonal block on. Each block needs
        // the unchanged blocks after it only, so the result overwrites it.
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

        // Columns: the first three block columns of T·Fᵀ, from the diagonal block on. The bias
        // columns of T are final.
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
}

/// The columns of a matrix given in row order.
#[inline(always)]
fn columns([x, y, z]: &Rotation) -> Rotation {
    [[x[0], y[0], z[0]], [x[1], y[1], z[1]], [x[2], y[2], z[2]]]
}
