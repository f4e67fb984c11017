//! Mahony's filter for gyro and accelerometer, as used in many small flight controllers.
//!
//! Measured and predicted gravity differ by a rotation; a share of it is added to the gyro's rate.
//! One gain, four numbers of state, thirty multiplications. Use it to level a multirotor at the
//! least cost. It does not estimate the gyro bias (a bias b leaves a tilt of b/gain), treats every
//! acceleration as gravity, and its heading is the integral of the gyro. Otherwise use
//! [`AttitudeFilter`](super::AttitudeFilter).
//!
//! Mahony, Hamel, Pflimlin, "Nonlinear complementary filters on the special orthogonal group", IEEE
//! TAC 53(5), 2008, without the integral term; one Euler step and normalisation, as in T.
//! Nakagawa's STM32 flight controller (2021). The published page gives gravity's first two
//! components with the signs of the inverse rotation, which would settle upside down; the signs
//! here are correct.

use super::rotation::within;
use stampfly_types::{Quat, Vec3, math};

/// The filter: an attitude and a gain.
///
/// ```
/// use stampfly_eskf::attitude::Mahony;
/// use stampfly_types::{Vec3, frame};
///
/// let mut filter = Mahony::new(0.5);
/// // Held still, rolled by 30°.
/// let force = Vec3::new(0.0, -0.5, -0.866_025) * 9.81;
/// for _ in 0..400 * 20 {
///     filter.step(&force, &Vec3::zeros(), 0.0025);
/// }
/// assert!((frame::roll_pitch_yaw(&filter.attitude())[0].to_degrees() - 30.0).abs() < 0.1);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Mahony {
    gain: f32,
    attitude: Quat,
}

impl Mahony {
    /// Level, heading zero. `gain` in 1/s: correction rate per radian of tilt error. 0.5 is usual.
    #[must_use]
    pub fn new(gain: f32) -> Self {
        Self { gain, attitude: Quat::identity() }
    }

    /// Body FRD → world NED. The heading is relative to the start.
    #[must_use]
    pub fn attitude(&self) -> Quat {
        self.attitude
    }

    /// Takes the specific force (body FRD, any unit), the rate (body FRD, rad/s) and the time since
    /// the last step, s.
    ///
    /// Without correction for a force that is zero or not finite. Ignored for a rate that is not
    /// finite or a time that is not positive. Times above half a second count as half a second.
    pub fn step(&mut self, accel: &Vec3, gyro: &Vec3, dt: f32) {
        // Larger rates, far beyond any sensor, would overflow the quaternion.
        if dt.is_nan() || dt <= 0.0 || !within(gyro, 1e6) {
            return;
        }
        let dt = dt.min(0.5);
        let [w, x, y, z] = self.attitude.wxyz();
        let mut rate = *gyro;
        let norm = accel.norm();
        if norm.is_finite() && norm > 0.0 {
            let down = Vec3::new(2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z);
            rate += (-accel / norm).cross(&down) * self.gain;
        }
        // One Euler step of the quaternion derivative ½·q ⊗ (0, rate).
        let change = [
            -x * rate.x - y * rate.y - z * rate.z,
            w * rate.x - z * rate.y + y * rate.z,
            z * rate.x + w * rate.y - x * rate.z,
            -y * rate.x + x * rate.y + w * rate.z,
        ]
        .map(|part| 0.5 * dt * part);
        let [w, x, y, z] = [w + change[0], x + change[1], y + change[2], z + change[3]];
        let norm = math::sqrt(w * w + x * x + y * y + z * z);
        if norm.is_finite() && norm > 0.0 {
            self.attitude = Quat::new_unchecked(w / norm, x / norm, y / norm, z / norm);
        }
    }
}
