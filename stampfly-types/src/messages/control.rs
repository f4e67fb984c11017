//! What the controller wants and what the motors get.

use crate::{Vec3, message};

/// The largest number of motors a message can carry.
pub const MAX_MOTORS: usize = 8;

message! {
    /// Force and torque the controller asks of the airframe.
    pub struct ControlOutput {
        /// Collective thrust along −z of the body.
        thrust: f32 ["N"],
        /// Torque about the body axes.
        torque: Vec3 ["N*m"],
    }
}

message! {
    /// What is sent to the motors.
    pub struct MotorOutput {
        /// Duty cycle per motor, 0 to 1. The StampFly's order: front right, rear right, rear left, front left.
        duty: [f32; MAX_MOTORS],
        /// How many of them exist.
        count: u8,
        /// May the motors turn? When not, every duty is exactly zero.
        armed: bool,
        /// Share of the torque demand that could not be met, 0 is none: roll, pitch, yaw, thrust.
        unmet: [f32; 4],
    }
}

impl MotorOutput {
    /// The share that was met, from 0 to 1, where this one was [unmet](Self::unmet). A number that
    /// is not a share counts as none: the whole demand was met.
    ///
    /// ```
    /// use stampfly_types::messages::MotorOutput;
    /// assert_eq!([0.0, 0.25, 2.0, -1.0, f32::NAN].map(MotorOutput::met), [1.0, 0.75, 0.0, 1.0, 1.0]);
    /// ```
    #[must_use]
    pub const fn met(unmet: f32) -> f32 {
        if unmet >= 1.0 {
            0.0
        } else if unmet > 0.0 {
            1.0 - unmet
        } else {
            1.0
        }
    }
}

/// The largest number of servos a message can carry.
pub const MAX_SERVOS: usize = 8;

message! {
    /// What is sent to the servos of control surfaces.
    pub struct ServoOutput {
        /// Deflection per servo as a share of the largest, −1 to 1; a positive one is trailing edge down, for a fin trailing edge left.
        deflection: [f32; MAX_SERVOS],
        /// How many of them exist.
        count: u8,
    }
}
