//! Measurements of sensors, in SI units and in the body frame, without any judgement of their
//! health.
//!
//! Chip axes, scales and hardware quirks are handled in the driver. From here on a sample has the
//! same meaning on every vehicle.

use crate::{Quat, Vec3, message, message_enum};

message! {
    /// One inertial sample.
    pub struct ImuData {
        /// Specific force, body FRD. Level and at rest: (0, 0, −9.81).
        accel: Vec3 ["m/s^2"],
        /// Angular rate, body FRD.
        gyro: Vec3 ["rad/s"],
        /// Die temperature.
        temperature: f32 ["degC"],
        /// Largest specific force since the previous sample that several consecutive samples of the
        /// chip agree on, for the detection of impacts; zero when unknown. Larger than `accel`
        /// under vibration.
        accel_peak: f32 ["m/s^2"],
    }
}

message! {
    /// One range from a time-of-flight sensor, along its own beam.
    pub struct TofData {
        /// Distance from the sensor to the nearest surface in the beam.
        distance: f32 ["m"],
        /// One standard deviation as reported by the chip; zero when it reports none.
        sigma: f32 ["m"],
        /// Status of the measurement in the numbering of ST's drivers, for the log: 0 valid, 1
        /// standard deviation too high, 2 signal too low, 4 phase out of bounds, 5 hardware, 6
        /// valid but not checked for wrap-around, 7 wrapped around, 8 not computed, 9 cover glass,
        /// 10 starting, 11 merged targets, 13 too close, 255 no new measurement.
        status: u8,
        /// Whether the driver considers the distance valid.
        valid: bool,
    }
}

message! {
    /// Optical flow since the previous sample, after the mounting rotation.
    ///
    /// Forward motion is positive in x, motion to the right positive in y. Rotation is included:
    /// pitching up (`q` > 0) adds to x, rolling right (`p` > 0) subtracts from y.
    pub struct FlowData {
        /// Angle of apparent motion along body x.
        delta_x: f32 ["rad"],
        /// Angle of apparent motion along body y.
        delta_y: f32 ["rad"],
        /// Time over which the angles accumulated.
        interval: f32 ["s"],
        /// Surface quality as a number of features, 0 without any.
        quality: u8,
        /// Whether the driver considers the sample valid.
        valid: bool,
    }
}

message! {
    /// One magnetometer sample.
    pub struct MagData {
        /// Magnetic flux density, body FRD, with the factory compensation but no correction of hard
        /// and soft iron.
        field: Vec3 ["uT"],
    }
}

message! {
    /// One barometer sample.
    pub struct BaroData {
        /// Static pressure.
        pressure: f32 ["Pa"],
        /// Die temperature.
        temperature: f32 ["degC"],
        /// Pressure altitude above 101 325 Pa in the standard atmosphere.
        altitude: f32 ["m"],
    }
}

message! {
    /// One sample of the battery monitor.
    pub struct PowerData {
        /// Battery voltage at the present load.
        voltage: f32 ["V"],
        /// Current drawn from the battery.
        current: f32 ["A"],
        /// Power drawn from the battery.
        power: f32 ["W"],
    }
}

message! {
    /// Pose of the vehicle as measured from outside: by motion capture, or by another vehicle.
    ///
    /// In the vehicle's world frame: north is the direction of its nose, and the origin its
    /// position, at power-on. The frame of the cameras has to be aligned to it. The estimator moves
    /// to this pose when its own estimate differs.
    pub struct ExternalPose {
        /// Position, world NED.
        position: Vec3 ["m"],
        /// Attitude, body FRD → world NED.
        attitude: Quat,
        /// Standard deviation of the position, per axis; zero when there is no position.
        position_sigma: f32 ["m"],
        /// Standard deviation of the attitude, per axis; zero when there is no attitude.
        attitude_sigma: f32 ["rad"],
    }
}

message_enum! {
    /// Kind of fix of a satellite receiver.
    pub enum GnssFix {
        /// No fix.
        #[default]
        None = 0,
        /// Horizontal position without altitude.
        TwoDimensional = 2,
        /// Position and altitude.
        ThreeDimensional = 3,
    }
}

message! {
    /// One fix of a satellite receiver (GNSS). Its stamp is the instant for which the fix is valid;
    /// receivers report it 50 to 300 ms later.
    ///
    /// An accuracy is one standard deviation as the receiver estimates it. [`GnssFix`] states which
    /// values are known; unknown values have no special number.
    pub struct GnssData {
        /// Kind of the fix.
        fix: GnssFix,
        /// Number of satellites in use.
        satellites: u8,
        /// Latitude in ten-millionths of a degree, north is positive.
        latitude: i32 ["1e-7 deg"],
        /// Longitude in ten-millionths of a degree, east is positive.
        longitude: i32 ["1e-7 deg"],
        /// Altitude above mean sea level.
        altitude: f32 ["m"],
        /// Velocity, world NED, from the Doppler shift of the signals.
        velocity: Vec3 ["m/s"],
        /// Accuracy of the position along north and along east.
        horizontal_accuracy: f32 ["m"],
        /// Accuracy of the position along down.
        vertical_accuracy: f32 ["m"],
        /// Accuracy of the velocity, per axis.
        speed_accuracy: f32 ["m/s"],
    }
}

message! {
    /// One sample of a pitot tube.
    pub struct AirspeedData {
        /// Total pressure less static pressure, with the sensor's offset removed. Noise and flow
        /// from behind make it negative.
        pressure: f32 ["Pa"],
        /// Air temperature at the sensor.
        temperature: f32 ["degC"],
    }
}
