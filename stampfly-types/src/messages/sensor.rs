//! What sensors report: facts, already in SI units and in the body frame, never a judgement.
//!
//! Chip axes, scales and register quirks end in the driver; from here inward a sample means the same for every
//! vehicle.

use crate::{Quat, Vec3, message, message_enum};

message! {
    /// One inertial sample.
    pub struct ImuData {
        /// Specific force, body FRD. Level and still: (0, 0, −9.81).
        accel: Vec3 ["m/s^2"],
        /// Angular rate, body FRD.
        gyro: Vec3 ["rad/s"],
        /// Die temperature.
        temperature: f32 ["degC"],
        /// Largest specific force since the sample before that several of the chip's own samples running agree on, for whoever has
        /// to see a blow as it begins; zero when it is not known. Larger than `accel` wherever it vibrates.
        accel_peak: f32 ["m/s^2"],
    }
}

message! {
    /// One range from a time-of-flight sensor, along its own beam.
    pub struct TofData {
        /// Distance from the sensor to the nearest surface in the beam.
        distance: f32 ["m"],
        /// One standard deviation as the chip reports it; zero when it does not.
        sigma: f32 ["m"],
        /// What the sensor says of the measurement, for the log, as ST's drivers number it: 0 valid, 1 standard deviation
        /// too high, 2 signal too low, 4 phase out of bounds, 5 hardware, 6 valid but not checked for wrap-around,
        /// 7 wrapped around, 8 not computed, 9 cover glass, 10 starting, 11 merged targets, 13 too close, 255 nothing new.
        status: u8,
        /// Does the driver vouch for the distance?
        valid: bool,
    }
}

message! {
    /// Optical flow since the previous sample, after the mounting rotation.
    ///
    /// Forward motion counts positive in x, motion to the right positive in y. Rotation is included: pitching up
    /// (`q` > 0) adds to x, rolling right (`p` > 0) subtracts from y.
    pub struct FlowData {
        /// Angle swept along body x.
        delta_x: f32 ["rad"],
        /// Angle swept along body y.
        delta_y: f32 ["rad"],
        /// Time over which the angles were swept.
        interval: f32 ["s"],
        /// Surface quality as the chip counts features, 0 is blind.
        quality: u8,
        /// Does the driver vouch for the sample?
        valid: bool,
    }
}

message! {
    /// One magnetometer sample.
    pub struct MagData {
        /// Magnetic flux density, body FRD, factory compensation applied, hard and soft iron not.
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
        /// Battery voltage under the present load.
        voltage: f32 ["V"],
        /// Current out of the battery.
        current: f32 ["A"],
        /// Power out of the battery.
        power: f32 ["W"],
    }
}

message! {
    /// Where somebody outside sees the vehicle: motion capture, or another vehicle's estimate of it.
    ///
    /// In the vehicle's world: north is where its nose pointed and the origin is where it stood when it was switched on,
    /// so the cameras' frame has to be set there. A vehicle whose own idea differs is moved to this one.
    pub struct ExternalPose {
        /// Position, world NED.
        position: Vec3 ["m"],
        /// Attitude, body FRD → world NED.
        attitude: Quat,
        /// Standard deviation of the position, per axis; zero when there is none.
        position_sigma: f32 ["m"],
        /// Standard deviation of the attitude, per axis; zero when there is none.
        attitude_sigma: f32 ["rad"],
    }
}

message_enum! {
    /// What a satellite receiver knows.
    pub enum GnssFix {
        /// Nothing.
        #[default]
        None = 0,
        /// Where it is on the map, but not how high.
        TwoDimensional = 2,
        /// Where it is.
        ThreeDimensional = 3,
    }
}

message! {
    /// One fix of a satellite receiver (GNSS). Its stamp is the instant for which it is valid; receivers report it 50 to 300 ms later.
    ///
    /// An accuracy is one standard deviation, as the receiver estimates it. What the fix does not know is marked by [`GnssFix`], not by a
    /// number.
    pub struct GnssData {
        /// What is known.
        fix: GnssFix,
        /// Satellites in use.
        satellites: u8,
        /// Latitude in ten-millionths of a degree, north is positive.
        latitude: i32 ["1e-7 deg"],
        /// Longitude in ten-millionths of a degree, east is positive.
        longitude: i32 ["1e-7 deg"],
        /// Above mean sea level.
        altitude: f32 ["m"],
        /// World NED, from the signals' Doppler shift.
        velocity: Vec3 ["m/s"],
        /// Along each of north and east.
        horizontal_accuracy: f32 ["m"],
        /// Along down.
        vertical_accuracy: f32 ["m"],
        /// Of the velocity, per axis.
        speed_accuracy: f32 ["m/s"],
    }
}

message! {
    /// One sample of a pitot tube.
    pub struct AirspeedData {
        /// Total pressure less static pressure, the sensor's zero taken away; below zero in air that comes from behind, and by noise.
        pressure: f32 ["Pa"],
        /// Of the air at the sensor.
        temperature: f32 ["degC"],
    }
}
