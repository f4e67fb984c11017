//! Output of the estimator and its uncertainty.

use crate::{Quat, Vec3, message, message_flags};

message_flags! {
    /// Outputs of an estimate that may be used. Values whose bit is cleared are placeholders.
    pub struct Validity {
        /// Roll and pitch.
        TILT = 0,
        /// Heading, relative to where it was at power-on or to north.
        HEADING = 1,
        /// Horizontal velocity.
        VELOCITY_XY = 2,
        /// Vertical velocity.
        VELOCITY_Z = 3,
        /// Horizontal position relative to the start.
        POSITION_XY = 4,
        /// Vertical position relative to the start.
        POSITION_Z = 5,
        /// Height above the surface below.
        HEIGHT = 6,
    }
}

message_flags! {
    /// A set of sensors: those that were used, or those that were rejected.
    pub struct SensorMask {
        /// Inertial measurement unit.
        IMU = 0,
        /// Downward time-of-flight.
        TOF = 1,
        /// Optical flow.
        FLOW = 2,
        /// Magnetometer.
        MAG = 3,
        /// Barometer.
        BARO = 4,
        /// Accelerometer used as an inclinometer.
        ACCEL_ATTITUDE = 5,
        /// Zero velocity while known to stand.
        STATIONARY = 6,
        /// External position or velocity, such as motion capture.
        EXTERNAL = 7,
    }
}

message! {
    /// The estimated state of the vehicle.
    pub struct StateEstimate {
        /// Attitude, body FRD → world NED.
        attitude: Quat,
        /// Position, world NED. The origin is where the estimator was initialised.
        position: Vec3 ["m"],
        /// Velocity, world NED.
        velocity: Vec3 ["m/s"],
        /// Angular rate, body FRD, bias removed.
        angular_rate: Vec3 ["rad/s"],
        /// Specific force, body FRD, bias removed. Level and at rest: (0, 0, −9.81).
        specific_force: Vec3 ["m/s^2"],
        /// Gyro bias, body FRD.
        gyro_bias: Vec3 ["rad/s"],
        /// Accelerometer bias, body FRD.
        accel_bias: Vec3 ["m/s^2"],
        /// Height of the body above the surface below.
        height: f32 ["m"],
        /// One standard deviation of the horizontal position: root of the trace of its covariance.
        position_std_xy: f32 ["m"],
        /// The quantities above that may be used.
        valid: Validity,
        /// Sensors that were used within the last second.
        sensors: SensorMask,
    }
}

message! {
    /// Innovations, test ratios and counters of the estimator, for plots and failsafe.
    ///
    /// A test ratio is innovation² / (gate² · variance). A measurement with a ratio above one is
    /// rejected.
    pub struct EstimatorStatus {
        /// Innovation of the last range, along the vertical.
        tof_innovation: f32 ["m"],
        /// Test ratio of the last range.
        tof_ratio: f32,
        /// Innovation of the last flow sample, body x and y.
        flow_innovation: [f32; 2] ["m/s"],
        /// Test ratio of the last flow sample.
        flow_ratio: f32,
        /// Innovation of the last barometric altitude.
        baro_innovation: f32 ["m"],
        /// Test ratio of the last barometric altitude.
        baro_ratio: f32,
        /// Innovation of the last magnetic heading.
        mag_innovation: f32 ["rad"],
        /// Test ratio of the last magnetic heading.
        mag_ratio: f32,
        /// Innovation of the accelerometer attitude: angle between measured and predicted gravity.
        accel_innovation: f32 ["rad"],
        /// Test ratio of the last accelerometer attitude.
        accel_ratio: f32,
        /// Measurements rejected since the start: range, flow, baro, mag, accelerometer.
        refused: [u32; 5],
        /// Measurements offered since the start, in the same order.
        offered: [u32; 5],
        /// Number of ranges and flow samples compared with the estimate, used or not, in the same
        /// order. Zero for the other sensors, and for an estimator that does not count them.
        tested: [u32; 5],
        /// Inertial samples rejected since the start: not finite, or garbage that was bridged.
        imu_refused: u32,
        /// Number of resets since the start.
        resets: u32,
        /// One standard deviation of the error in horizontal acceleration that comes from tilt and
        /// accelerometer biases; the larger of both axes. On the ground it is small at any tilt.
        acceleration_sigma: f32 ["m/s^2"],
        /// One standard deviation of the horizontal velocity; the larger of both axes.
        velocity_sigma: f32 ["m/s"],
        /// One standard deviation of the climb rate.
        climb_sigma: f32 ["m/s"],
        /// One standard deviation of the gyro bias about roll and pitch; the larger of both.
        gyro_bias_sigma: f32 ["rad/s"],
        /// One standard deviation of the gyro bias about yaw.
        yaw_bias_sigma: f32 ["rad/s"],
        /// Whether the estimate has diverged.
        diverged: bool,
    }
}

message! {
    /// Commands of the mode machine to the estimator. Level-triggered, except for the reset
    /// counters.
    pub struct EstimatorCommand {
        /// The vehicle stands still on the ground: hold velocity at zero.
        on_ground: bool,
        /// The vehicle is airborne, carried by its propellers.
        flying: bool,
        /// The accelerometer has failed: its samples are not the specific force.
        accel_faulty: bool,
        /// A change of this number resets position and velocity to zero.
        origin_resets: u32,
        /// A change of this number restarts the estimator from the calibration.
        full_resets: u32,
    }
}

message! {
    /// Result of the calibration at rest.
    pub struct CalibrationResult {
        /// Gyro bias, body FRD.
        gyro_bias: Vec3 ["rad/s"],
        /// Mean specific force at rest, body FRD. Initialises the attitude.
        specific_force: Vec3 ["m/s^2"],
        /// Mean magnetic field at rest, body FRD; zero without a magnetometer.
        field: Vec3 ["uT"],
        /// Barometric altitude of the ground.
        baro_altitude: f32 ["m"],
        /// Share of the samples at rest that has been collected, 0 to 1.
        progress: f32,
        /// Whether the calibration has finished and the values above may be used.
        complete: bool,
        /// Number of times that motion restarted the collection.
        restarts: u32,
    }
}

message! {
    /// State of the air, from pitot tube and satellite receiver.
    pub struct AirState {
        /// True airspeed.
        airspeed: f32 ["m/s"],
        /// Indicated airspeed: the reading of a pitot tube at sea level, on which the forces on
        /// wings and surfaces depend.
        indicated: f32 ["m/s"],
        /// Wind as the velocity of the air over ground, north and east: the direction it blows to.
        wind: [f32; 2] ["m/s"],
        /// One standard deviation of the wind's less certain component.
        wind_sigma: f32 ["m/s"],
        /// Whether the airspeed was measured by the pitot tube. Otherwise it is the velocity over
        /// ground less the last known wind.
        measured: bool,
    }
}
