//! A vehicle for the crate `kfilter`, which has filters and no models: position, velocity, Euler angles and the two
//! biases, written the way its users would.
//!
//! Measurements are rows of the state, so that only the filter is measured and not our idea of a sensor. Not for flying:
//! Euler angles have no pitch of 90°.

use kfilter::EKF;
use kfilter::system::StepReturn;
use nalgebra_034::{Matrix3, SMatrix, SVector, Vector1, Vector2, Vector3};
use stampfly_benches::stream::{Step, Truth};
use stampfly_types::{GRAVITY, Vec3, math};

/// States.
const N: usize = 15;
/// Accelerometer and gyro.
const U: usize = 6;
const DT: f32 = super::PERIOD;

/// A step as the filter takes it.
pub struct Input {
    pub imu: SVector<f32, U>,
    pub tof: Option<Vector1<f32>>,
    pub flow: Option<Vector2<f32>>,
    pub baro: Option<Vector1<f32>>,
    pub mag: Option<Vector3<f32>>,
}

impl Input {
    pub fn new(step: &Step) -> Self {
        let Truth { position, velocity, .. } = step.truth;
        let (accel, gyro) = (step.imu.accel, step.imu.gyro);
        Self {
            imu: [accel.x, accel.y, accel.z, gyro.x, gyro.y, gyro.z].into(),
            tof: step.tof.map(|_| Vector1::new(position.z)),
            flow: step.flow.map(|_| Vector2::new(velocity.x, velocity.y)),
            baro: step.baro.map(|_| Vector1::new(position.z)),
            mag: step.mag.map(|_| angles(&step.truth)),
        }
    }
}

fn angles(truth: &Truth) -> Vector3<f32> {
    Vector3::from(stampfly_types::frame::roll_pitch_yaw(&truth.attitude))
}

/// The filter at a point of the path.
pub fn filter(truth: &Truth) -> EKF<f32, N, U> {
    let mut state = SVector::<f32, N>::zeros();
    let vector = |v: &Vec3| Vector3::new(v.x, v.y, v.z);
    state.fixed_rows_mut::<3>(0).copy_from(&vector(&truth.position));
    state.fixed_rows_mut::<3>(3).copy_from(&vector(&truth.velocity));
    state.fixed_rows_mut::<3>(6).copy_from(&angles(truth));
    EKF::new_ekf_with_input(transition, state, SMatrix::identity() * 1e-2)
}

/// The observation of `M` states.
pub fn rows<const M: usize>(first: usize) -> SMatrix<f32, M, N> {
    SMatrix::from_fn(|row, column| if column == first + row { 1.0 } else { 0.0 })
}

fn transition(x: SVector<f32, N>, u: SVector<f32, U>) -> StepReturn<f32, N> {
    let part = |first: usize| x.fixed_rows::<3>(first).into_owned();
    let (velocity, angles) = (part(3), part(6));
    let force = u.fixed_rows::<3>(0) - part(12);
    let rate = u.fixed_rows::<3>(3) - part(9);
    let [(sr, cr), (sp, cp), (sy, cy)] = [0, 1, 2].map(|axis| math::sin_cos(angles[axis]));
    let tp = sp / cp;

    let roll = Matrix3::new(1.0, 0.0, 0.0, 0.0, cr, -sr, 0.0, sr, cr);
    let pitch = Matrix3::new(cp, 0.0, sp, 0.0, 1.0, 0.0, -sp, 0.0, cp);
    let yaw = Matrix3::new(cy, -sy, 0.0, sy, cy, 0.0, 0.0, 0.0, 1.0);
    let rotation = yaw * pitch * roll;
    let acceleration = rotation * force;
    let rates = Matrix3::new(1.0, sr * tp, cr * tp, 0.0, cr, -sr, 0.0, sr / cp, cr / cp);

    let mut state = x;
    state.fixed_rows_mut::<3>(0).copy_from(&(part(0) + velocity * DT));
    state.fixed_rows_mut::<3>(3).copy_from(&(velocity + (acceleration + Vector3::z() * GRAVITY) * DT));
    state.fixed_rows_mut::<3>(6).copy_from(&(angles + rates * rate * DT));

    let across = cr * rate.y - sr * rate.z;
    let along = sr * rate.y + cr * rate.z;
    let by_angles = [
        rotation * Vector3::x().cross(&force),
        yaw * Vector3::y().cross(&(pitch * roll * force)),
        Vector3::z().cross(&acceleration),
    ];
    let angles_by_angles =
        Matrix3::new(tp * across, along / (cp * cp), 0.0, -along, 0.0, 0.0, across / cp, along * tp / cp, 0.0);
    let mut jacobian = SMatrix::<f32, N, N>::identity();
    let mut block = |row, column, value: Matrix3<f32>| {
        let mut view = jacobian.fixed_view_mut::<3, 3>(row, column);
        view += value * DT;
    };
    block(0, 3, Matrix3::identity());
    block(3, 6, Matrix3::from_columns(&by_angles));
    block(3, 12, -rotation);
    block(6, 6, angles_by_angles);
    block(6, 9, -rates);

    // The noise densities of our filter.
    let mut covariance = SMatrix::<f32, N, N>::zeros();
    for (first, density) in [(3, 0.3f32), (6, 0.003), (9, 3e-5), (12, 1e-3)] {
        for axis in first..first + 3 {
            covariance[(axis, axis)] = density * density * DT;
        }
    }
    StepReturn { state, jacobian, covariance }
}
