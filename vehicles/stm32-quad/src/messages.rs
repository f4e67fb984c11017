//! What travels on the quadcopter's topics, beside the family's own messages.

use stampfly_link::hisky::HiskyChannels;
use stampfly_types::{Quat, Vec3, message};

message! {
    /// What the transmitter says: sticks and switches, 0 to 1 each, a stick at rest in the middle at 0.5. A throttle that is down is 0.
    pub struct ReceiverInput {
        /// Roll, right is 1.
        roll: f32,
        /// Pitch, nose up is 1.
        pitch: f32,
        /// Yaw, clockwise seen from above is 1.
        yaw: f32,
        /// Throttle.
        throttle: f32,
        /// Channels 5 to 8. The first chooses the mode.
        aux: [f32; 4],
    }
}

message! {
    /// The filtered motion and the attitude that follows from it.
    pub struct Attitude {
        /// Body FRD → world NED; heading relative to where it was at power-on.
        attitude: Quat,
        /// Roll, pitch, yaw.
        angle: Vec3 ["rad"],
        /// Angular rate, body FRD, offset removed and filtered.
        rate: Vec3 ["rad/s"],
        /// Specific force, body FRD, offset removed and filtered.
        accel: Vec3 ["m/s^2"],
    }
}

message! {
    /// What the pilot's gestures and the receiver have made of the vehicle.
    pub struct ControlState {
        /// May the motors turn?
        armed: bool,
        /// Are the sensors being calibrated?
        calibrating: bool,
        /// ANGLE, where a stick is an angle; otherwise ACRO, where it is a rate.
        angle_mode: bool,
        /// Is the transmitter heard?
        online: bool,
    }
}

message! {
    /// What the rate loops want, about roll, pitch, yaw.
    pub struct RateDemand {
        /// Rate that is wanted.
        setpoint: Vec3 ["rad/s"],
        /// Share of a motor's whole range that each axis asks for, not limited.
        output: Vec3,
    }
}

message! {
    /// The battery's voltage as the converter counts it, 12 bits.
    pub struct BatterySample {
        /// 0 to 4095.
        counts: u32,
    }
}

message! {
    /// The battery. Its two flags change the lights and nothing else.
    pub struct BatteryState {
        /// Filtered voltage of all cells.
        voltage: f32 ["V"],
        /// At or below the warning level.
        low: bool,
        /// At or below the critical level.
        empty: bool,
    }
}

message! {
    /// The two lights.
    pub struct Lights {
        /// At the front.
        front: bool,
        /// At the back.
        back: bool,
    }
}

message! {
    /// What a calibration has found, as it was measured on a level table.
    pub struct SensorOffsets {
        /// Of the accelerometer, body FRD, gravity not included.
        accel: Vec3 ["m/s^2"],
        /// Of the gyro, body FRD.
        gyro: Vec3 ["rad/s"],
    }
}

impl From<&HiskyChannels> for ReceiverInput {
    fn from(channels: &HiskyChannels) -> Self {
        let [roll, pitch, yaw, throttle, aux @ ..] = channels.values();
        Self { roll, pitch, yaw, throttle, aux }
    }
}
