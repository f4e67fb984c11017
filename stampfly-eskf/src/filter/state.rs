//! The nominal state, its propagation by inertial samples and its correction; quaternion and
//! rotation helpers.

use super::layout::{ACCEL_BIAS, ATTITUDE, GYRO_BIAS, N, POSITION, VELOCITY};
use stampfly_types::{GRAVITY, Quat, Vec3};

/// The nominal state: the estimate without its covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NominalState {
    /// World NED, m.
    pub position: Vec3,
    /// World NED, m/s.
    pub velocity: Vec3,
    /// Body → world, as w, x, y, z.
    pub attitude: [f32; 4],
    /// Body, rad/s.
    pub gyro_bias: Vec3,
    /// Body, m/s².
    pub accel_bias: Vec3,
}

impl Default for NominalState {
    fn default() -> Self {
        Self {
            position: Vec3::zeros(),
            velocity: Vec3::zeros(),
            attitude: [1.0, 0.0, 0.0, 0.0],
            gyro_bias: Vec3::zeros(),
            accel_bias: Vec3::zeros(),
        }
    }
}

/// Rotations by this angle or more are ignored, rad. No vehicle turns so far between two samples,
/// and no valid measurement corrects so far. Covariances that contradict each other produce such
/// corrections, whose powers overflow.
pub const FARTHEST_TURN: f32 = 1e4;

/// A rotation matrix in row order, body → world.
pub type Rotation = [[f32; 3]; 3];

/// Motion over one inertial sample. Covariance and history are propagated with the same numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Specific force without bias, body, m/s².
    pub force: Vec3,
    /// Angular rate without bias, body, rad/s.
    pub rate: Vec3,
    /// Rotation of the body over the step: attitude after = attitude before ⊗ delta_rotation.
    pub delta_rotation: [f32; 4],
    /// Specific force times the length of the step, world, m/s.
    pub delta_velocity: Vec3,
    /// Length of the step, s.
    pub dt: f32,
}

impl NominalState {
    /// Propagates the state by one inertial sample: half the rotation, then velocity and position
    /// with that attitude, then the other half. Second order in `dt`.
    #[inline]
    pub fn propagate(&mut self, accel: &Vec3, gyro: &Vec3, dt: f32) -> Motion {
        let force = accel - self.accel_bias;
        let rate = gyro - self.gyro_bias;
        let turn = rate * (0.5 * dt);
        let half = small_rotation(turn);
        let delta_velocity = turn_by(multiply(self.attitude, half), &force) * dt;
        let gained = delta_velocity + Vec3::new(0.0, 0.0, GRAVITY * dt);
        // With the mean velocity of the step.
        self.position += (self.velocity + gained * 0.5) * dt;
        self.velocity += gained;
        let delta_rotation = twice(half);
        self.attitude = normalize(multiply(self.attitude, delta_rotation));
        Motion { force, rate, delta_rotation, delta_velocity, dt }
    }

    /// Applies an error-state correction.
    #[inline]
    pub fn correct(&mut self, correction: &[f32; N]) {
        let at = |first: usize| Vec3::new(correction[first], correction[first + 1], correction[first + 2]);
        self.position += at(POSITION);
        self.velocity += at(VELOCITY);
        self.gyro_bias += at(GYRO_BIAS);
        self.accel_bias += at(ACCEL_BIAS);
        self.attitude = normalize(multiply(self.attitude, small_rotation(at(ATTITUDE))));
    }

    /// The attitude as a matrix, body → world.
    #[inline]
    #[must_use]
    pub fn rotation(&self) -> Rotation {
        rotation_matrix(self.attitude)
    }

    /// Cosine of the tilt, the angle between body z and world down.
    #[inline]
    #[must_use]
    pub fn cos_tilt(&self) -> f32 {
        let [_, x, y, _] = self.attitude;
        1.0 - 2.0 * (x * x + y * y)
    }

    /// The attitude as the family's quaternion type.
    #[must_use]
    pub fn quat(&self) -> Quat {
        let [w, x, y, z] = self.attitude;
        Quat::new_unchecked(w, x, y, z)
    }

    /// Whether every number is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        // Any NaN or infinity makes the sum not finite.
        let sum = self.position.sum() + self.velocity.sum() + self.gyro_bias.sum() + self.accel_bias.sum();
        (sum + self.attitude.iter().sum::<f32>()).is_finite()
    }
}

/// Body to world: matrix · body.
#[inline]
#[must_use]
pub fn rotate(rotation: &Rotation, body: &Vec3) -> Vec3 {
    let row = |r: &[f32; 3]| r[0] * body.x + r[1] * body.y + r[2] * body.z;
    Vec3::new(row(&rotation[0]), row(&rotation[1]), row(&rotation[2]))
}

/// World to body: matrixᵀ · world.
#[inline]
#[must_use]
pub fn rotate_back(rotation: &Rotation, world: &Vec3) -> Vec3 {
    let column = |c: usize| rotation[0][c] * world.x + rotation[1][c] * world.y + rotation[2][c] * world.z;
    Vec3::new(column(0), column(1), column(2))
}

/// Rotates a vector by a unit quaternion; cheaper than the matrix for a single vector.
#[inline]
fn turn_by([w, x, y, z]: [f32; 4], body: &Vec3) -> Vec3 {
    let axis = Vec3::new(x, y, z);
    let twice = axis.cross(body) * 2.0;
    body + twice * w + axis.cross(&twice)
}

/// The rotation matrix of a unit quaternion (w, x, y, z).
#[inline]
#[must_use]
pub fn rotation_matrix([w, x, y, z]: [f32; 4]) -> Rotation {
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

/// The product of two quaternions.
#[inline]
#[must_use]
pub fn multiply(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

/// The inverse rotation of a unit quaternion.
#[inline]
#[must_use]
pub(crate) fn conjugate([w, x, y, z]: [f32; 4]) -> [f32; 4] {
    [w, -x, -y, -z]
}

/// Quaternion of a rotation vector, by a fourth-order series without transcendentals. Exact to
/// `f32` below 0.3 rad; normalised beyond 1 rad, where the series is no longer a rotation. The
/// identity for [`FARTHEST_TURN`] or more.
#[inline]
#[must_use]
pub fn small_rotation(turn: Vec3) -> [f32; 4] {
    let (x, y, z) = (0.5 * turn.x, 0.5 * turn.y, 0.5 * turn.z);
    let square = x * x + y * y + z * z;
    let scale = 1.0 - square * (1.0 / 6.0) * (1.0 - square * (1.0 / 20.0));
    let real = 1.0 - square * 0.5 * (1.0 - square * (1.0 / 12.0));
    let series = [real, x * scale, y * scale, z * scale];
    if square <= 0.25 {
        series
    } else if square >= 0.25 * FARTHEST_TURN * FARTHEST_TURN {
        [1.0, 0.0, 0.0, 0.0]
    } else {
        // The length would scale the covariance. NaN also takes this branch and stays NaN.
        normalize(series)
    }
}

/// The square of a unit quaternion: the same rotation twice.
#[inline]
fn twice([w, x, y, z]: [f32; 4]) -> [f32; 4] {
    [2.0 * w * w - 1.0, 2.0 * w * x, 2.0 * w * y, 2.0 * w * z]
}

/// Normalises to unit length: a second-order series close to it, a square root otherwise.
#[inline]
pub(crate) fn normalize(q: [f32; 4]) -> [f32; 4] {
    let square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    let off = square - 1.0;
    let scale =
        if off.abs() < 1e-3 { 1.0 - 0.5 * off + 0.375 * off * off } else { 1.0 / stampfly_types::math::sqrt(square) };
    q.map(|v| v * scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;
    use proptest::prelude::*;

    /// Sizes of rotations, rad.
    const SIZES: &[f32] = &[1e-10, 1e-3, 0.5, 1.0, 3.0, 30.0, 1e3, 1e4, 1e10, 1e19, 1e30, 1e38];

    proptest! {
        #[test]
        fn attitude_follows_the_exact_exponential(x in -0.3f32..0.3, y in -0.3f32..0.3, z in -0.3f32..0.3) {
            let exact = Quat::from_scaled_axis(Vec3::new(x, y, z));
            let series = normalize(small_rotation(Vec3::new(x, y, z)));
            for (a, b) in series.iter().zip(exact.wxyz()) {
                prop_assert!((a - b).abs() < 1e-6);
            }
        }

        /// Corrections of any size, as contradicting covariances produce them.
        #[test]
        fn any_correction_leaves_a_rotation(x in any::<f32>(), y in any::<f32>(), z in any::<f32>(), size in prop::sample::select(SIZES)) {
            prop_assume!(x.is_finite() && y.is_finite() && z.is_finite());
            for turn in [[x, y, z], [x, y, z].map(|value| value.signum() * size), [0.0, x, 0.0]] {
                let mut state = NominalState::default();
                let mut correction = [0.0; N];
                correction[ATTITUDE..ATTITUDE + 3].copy_from_slice(&turn);
                state.correct(&correction);
                state.correct(&correction);
                prop_assert!((state.quat().norm_squared() - 1.0).abs() < 1e-5, "{turn:?}: {:?}", state.attitude);
            }
        }

        #[test]
        fn quaternion_stays_unit(rates in prop::collection::vec((-35f32..35.0, -35f32..35.0, -35f32..35.0), 1..200)) {
            let mut state = NominalState::default();
            for (x, y, z) in rates {
                state.propagate(&Vec3::new(0.0, 0.0, -9.8), &Vec3::new(x, y, z), 0.0025);
            }
            let norm: f32 = state.attitude.iter().map(|v| v * v).sum();
            prop_assert!((norm - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn motion_reports_the_change_of_the_state() {
        let before = crate::aid::numeric::awkward_state();
        let mut after = before;
        let motion = after.propagate(&Vec3::new(1.0, -2.0, -9.0), &Vec3::new(0.5, 1.0, -3.0), 0.0025);
        let turned = multiply(before.attitude, motion.delta_rotation);
        for (a, b) in turned.iter().zip(after.attitude) {
            assert_abs_diff_eq!(*a, b, epsilon = 1e-6);
        }
        let gained = after.velocity - before.velocity - Vec3::new(0.0, 0.0, GRAVITY * motion.dt);
        assert!((gained - motion.delta_velocity).amax() < 1e-6);
    }

    #[test]
    fn free_fall_accelerates_and_a_stationary_body_does_not_move() {
        let mut state = NominalState::default();
        for _ in 0..400 {
            state.propagate(&Vec3::zeros(), &Vec3::zeros(), 0.0025);
        }
        assert_abs_diff_eq!(state.velocity.z, GRAVITY, epsilon = 1e-3);
        assert_abs_diff_eq!(state.position.z, 0.5 * GRAVITY, epsilon = 1e-3);
        let mut state = NominalState::default();
        for _ in 0..400 {
            state.propagate(&Vec3::new(0.0, 0.0, -GRAVITY), &Vec3::zeros(), 0.0025);
        }
        assert_eq!(state.velocity, Vec3::zeros());
    }
}
