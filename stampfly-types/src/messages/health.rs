//! How each sensor fares, and what an estimate is to be put right by.

use crate::{Instant, Vec3, message, message_enum};

message_enum! {
    /// What is wrong with a sensor.
    pub enum Finding {
        /// Nothing that shows.
        #[default]
        None = 0,
        /// It repeats a reading, or stays at the end of its range.
        Stuck = 1,
        /// It shows nothing of a motion that it should see.
        Blind = 2,
        /// It moved by more than the vehicle can, from one moment to the next.
        Jumped = 3,
        /// Single readings are far from their neighbours, and they are many.
        Outliers = 4,
        /// It contradicts the other sensors.
        Disagrees = 5,
        /// Its zero has moved; what it measures is used with the new one.
        Shifted = 6,
    }
}

message! {
    /// The state of one sensor.
    pub struct Health {
        /// What is wrong with it.
        finding: Finding,
        /// When that was found.
        since: Instant,
    }
}

impl Health {
    /// Is what the sensor measures left out of the estimate?
    #[must_use]
    pub fn is_left_out(&self) -> bool {
        !matches!(self.finding, Finding::None | Finding::Shifted)
    }
}

message! {
    /// The state of every sensor that is judged. A sensor with a finding other than
    /// [`Finding::None`] and [`Finding::Shifted`] is left out of the estimate.
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
    /// By how much an estimate is wrong, because a sensor misled it: what to add, and how uncertain
    /// the sum is.
    pub struct EstimateCorrection {
        /// Turn of the attitude, about world axes.
        turn: Vec3 ["rad"],
        /// World NED.
        velocity: Vec3 ["m/s"],
        /// World down.
        down: f32 ["m"],
        /// Body FRD.
        gyro_bias: Vec3 ["rad/s"],
        /// Body FRD.
        accel_bias: Vec3 ["m/s^2"],
        /// One standard deviation of the tilt afterwards, added to what it was.
        tilt_sigma: f32 ["rad"],
        /// The same of the horizontal velocity.
        velocity_sigma: f32 ["m/s"],
        /// The same of the gyro's bias about roll and pitch.
        gyro_bias_sigma: f32 ["rad/s"],
        /// The same of height and climb rate together; zero where they are right.
        climb_sigma: f32 ["m/s"],
    }
}
