//! Outputs of the controller and commands to motors and servos.

use crate::{Vec3, message};

/// Maximum number of motors in a message.
pub const MAX_MOTORS: usize = 8;

message! {
    /// Force and torque demanded of the airframe.
    pub struct ControlOutput {
        /// Collective thrust along the body's −z axis.
        thrust: f32 ["N"],
        /// Torque about the body axes, FRD.
        torque: Vec3 ["N*m"],
    }
}

message! {
    /// Command to the motors.
    pub struct MotorOutput {
        /// Duty cycle per motor, 0 to 1. Order on the StampFly: front right, rear right, rear left,
        /// front left.
        duty: [f32; MAX_MOTORS],
        /// Number of motors in use.
        count: u8,
        /// Whether the motors may turn. If not, every duty is exactly zero.
        armed: bool,
        /// Share of the demand that the motors cannot deliver, 0 to 1: roll, pitch, yaw, thrust.
        unmet: [f32; 4],
    }
}

impl MotorOutput {
    /// The delivered share, 0 to 1, for an [unmet](Self::unmet) share. A negative number or NaN
    /// counts as zero unmet.
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

/// Maximum number of servos in a message.
pub const MAX_SERVOS: usize = 8;

message! {
    /// Command to the servos of control surfaces.
    pub struct ServoOutput {
        /// Deflection per servo as a share of the largest, −1 to 1. Positive is trailing edge down;
        /// for a fin, trailing edge left.
        deflection: [f32; MAX_SERVOS],
        /// Number of servos in use.
        count: u8,
    }
}
