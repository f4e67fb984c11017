//! Operation with a faulty accelerometer and a working gyro, for a landing.
//!
//! The thrust is assumed to carry the weight: a specific force of one g along body z. Its direction
//! is right for any tilt, its size is wrong by the difference between thrust and weight. The
//! accelerometer's vertical bias models that difference as a random walk, which range or barometer
//! observe.
//!
//! Gravity and drag updates are disabled, because both use the accelerometer. Range, flow and
//! barometer are fused as before.

use super::*;

/// Noise density of the assumed force, m/s²/√Hz. Drag and gusts of 1 m/s accelerate a palm-sized
/// vehicle by 0.5 m/s² for a second.
pub(super) const UNFELT_NOISE: f32 = 0.5;
/// Random walk of the difference between thrust and weight, m/s²/√s: a tenth of the weight in a
/// quarter of a second.
const THRUST_WALK: f32 = 2.0;
/// Velocity error until the fault is detected, m/s: one g for 50 ms.
const MISLED: f32 = 0.5;

/// Specific force used in place of the accelerometer's, body FRD, m/s².
pub(super) const fn unfelt() -> Vec3 {
    Vec3::new(0.0, 0.0, -GRAVITY)
}

impl Eskf {
    /// Switches to operation without accelerometer: velocity and biases absorbed the fault until
    /// now.
    pub(super) fn begin_unfelt(&mut self) {
        for axis in 0..3 {
            self.covariance.inflate(VELOCITY + axis, MISLED * MISLED);
            self.reset_accel_bias(axis);
        }
    }

    /// Replaces the updates with gravity and drag over `dt` seconds.
    pub(super) fn go_on_unfelt(&mut self, dt: f32) {
        self.covariance.inflate(ACCEL_BIAS + 2, THRUST_WALK * THRUST_WALK * dt);
        if self.anchor.is_none() && !self.is_velocity_aided() {
            self.reset_unobserved_motion();
        }
    }
}
