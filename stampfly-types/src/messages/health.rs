//! Health of each sensor, and corrections of an estimate after a sensor fault.

use crate::{Instant, Vec3, message, message_enum};

message_enum! {
    /// Fault of a sensor.
    pub enum Finding {
        /// No fault detected.
        #[default]
        None = 0,
        /// It repeats a reading, or stays at the end of its range.
        Stuck = 1,
        /// It does not follow a motion that it should measure.
        Blind = 2,
        /// Its reading moved faster than the vehicle can.
        Jumped = 3,
        /// Frequent single readings far from their neighbours.
        Outliers = 4,
        /// It contradicts the other sensors.
        Disagrees = 5,
        /// Its offset has changed. Its measurements are used with the new offset.
        Shifted = 6,
    }
}

message! {
    /// Health of one sensor.
    pub struct Health {
        /// The fault that was detected.
        finding: Finding,
        /// Time of the detection.
        since: Instant,
    }
}

impl Health {
    /// Whether the estimator ignores the sensor.
    #[must_use]
    pub fn is_left_out(&self) -> bool {
        !matches!(self.finding, Finding::None | Finding::Shifted)
    }
}

message! {
    /// Health of every monitored sensor. The estimator ignores a sensor with a finding other than
    /// [`Finding::None`] and [`Finding::Shifted`].
    pub struct SensorFindings {
        /// Gyro.
        gyro: Health,
        /// Range to the ground.
        range: Health,
        /// Optical flow.
        flow: Health,
        /// Barometer.
        baro: Health,
    }
}

message! {
    /// Correction of an estimate after a faulty sensor has corrupted it: values to add, and their
    /// uncertainty.
    pub struct EstimateCorrection {
        /// Rotation of the attitude about world axes.
        turn: Vec3 ["rad"],
        /// Velocity, world NED.
        velocity: Vec3 ["m/s"],
        /// Position, world down.
        down: f32 ["m"],
        /// Gyro bias, body FRD.
        gyro_bias: Vec3 ["rad/s"],
        /// Accelerometer bias, body FRD.
        accel_bias: Vec3 ["m/s^2"],
        /// One standard deviation of the tilt after the correction, added to the present one.
        tilt_sigma: f32 ["rad"],
        /// The same for the horizontal velocity.
        velocity_sigma: f32 ["m/s"],
        /// The same for the gyro bias about roll and pitch.
        gyro_bias_sigma: f32 ["rad/s"],
        /// The same for height and climb rate together; zero when they need no correction.
        climb_sigma: f32 ["m/s"],
    }
}
