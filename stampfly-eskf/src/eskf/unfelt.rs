//! A vehicle whose accelerometer does not measure, and whose gyro does.
//!
//! Its thrust is taken to carry its weight: a specific force of one g along the body's axis. That
//! has the right direction whatever the tilt, and is wrong in size by what the thrust differs from
//! the weight. The bias of the vertical axis stands for that difference, as it walks with the
//! thrust, and range or barometer find it.
//!
//! Gravity is no vertical then, and drag shows no velocity: both are what the accelerometer would
//! have said. Range, flow and barometer are fused as before. It is for a landing.

use super::*;

/// Noise density of that force, m/s²/√Hz: drag and gusts of 1 m/s accelerate a palm-sized vehicle by
/// 0.5 m/s², for a second.
pub(super) const UNFELT_NOISE: f32 = 0.5;
/// How fast thrust moves away from the weight, m/s²/√s: a tenth of it in a quarter of a second.
const THRUST_WALK: f32 = 2.0;
/// What a sensor that said nothing did to the velocity until that was known, m/s: one g for 50 ms.
const MISLED: f32 = 0.5;

/// What is integrated in place of the accelerometer's, body FRD, m/s².
pub(super) const fn unfelt() -> Vec3 {
    Vec3::new(0.0, 0.0, -GRAVITY)
}

impl Eskf {
    /// The accelerometer was found not to measure.
    pub(super) fn begin_unfelt(&mut self) {
        for axis in 0..3 {
            self.covariance.inflate(VELOCITY + axis, MISLED * MISLED);
            self.reset_accel_bias(axis);
        }
    }

    /// What is done in place of updates with gravity and drag, for `dt` seconds.
    pub(super) fn go_on_unfelt(&mut self, dt: f32) {
        self.covariance.inflate(ACCEL_BIAS + 2, THRUST_WALK * THRUST_WALK * dt);
        if self.anchor.is_none() && !self.is_velocity_aided() {
            self.reset_unobserved_motion();
        }
    }
}
