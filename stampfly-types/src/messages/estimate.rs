//! What the estimator knows, and how well.

use crate::{Quat, Vec3, message, message_flags};

message_flags! {
    /// Which outputs of an estimate may be used. A cleared bit means the number beside it is a placeholder.
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
    /// A set of sensors: the ones that took part, or the ones that were refused.
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
    /// The vehicle's state as the estimator sees it.
    pub struct StateEstimate {
        /// Body FRD → world NED.
        attitude: Quat,
        /// World NED, origin where the vehicle was initialised.
        position: Vec3 ["m"],
        /// World NED.
        velocity: Vec3 ["m/s"],
        /// Body FRD, bias removed.
        angular_rate: Vec3 ["rad/s"],
        /// Body FRD, bias removed. Level and still: (0, 0, −9.81).
        specific_force: Vec3 ["m/s^2"],
        /// Gyro bias, body FRD.
        gyro_bias: Vec3 ["rad/s"],
        /// Accelerometer bias, body FRD.
        accel_bias: Vec3 ["m/s^2"],
        /// Height of the body above the surface below.
        height: f32 ["m"],
        /// One standard deviation of the horizontal position, root of the trace.
        position_std_xy: f32 ["m"],
        /// Which of the above may be used.
        valid: Validity,
        /// Sensors that took part within the last second.
        sensors: SensorMask,
    }
}

message! {
    /// How the estimator got on with its sensors: one number per measurement, for plots and failsafe.
    ///
    /// A test ratio is innovation² / (gate² · variance): above one the measurement was refused.
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
        /// Angle between measured and predicted gravity.
        accel_innovation: f32 ["rad"],
        /// Test ratio of the last accelerometer attitude.
        accel_ratio: f32,
        /// Measurements refused since the start: range, flow, baro, mag, accelerometer.
        refused: [u32; 5],
        /// Measurements offered since the start, in the same order.
        offered: [u32; 5],
        /// Ranges and flow that were compared with the estimate, used or not, in the same order; zero for
        /// the others and for an estimator that does not count them.
        tested: [u32; 5],
        /// Inertial samples refused since the start: not finite, or garbage that was bridged.
        imu_refused: u32,
        /// Resets since the start.
        resets: u32,
        /// One standard deviation of the horizontal acceleration that tilt and accelerometer biases make
        /// of the specific force, the larger of both axes'. On the ground it is small whatever the tilt.
        acceleration_sigma: f32 ["m/s^2"],
        /// One standard deviation of the horizontal velocity, the larger of both axes'.
        velocity_sigma: f32 ["m/s"],
        /// One standard deviation of the climb rate.
        climb_sigma: f32 ["m/s"],
        /// One standard deviation of the gyro's bias about roll and pitch, the larger of both.
        gyro_bias_sigma: f32 ["rad/s"],
        /// The same about yaw.
        yaw_bias_sigma: f32 ["rad/s"],
        /// Is the estimate lost?
        diverged: bool,
    }
}

message! {
    /// What the mode machine asks of the estimator. Level-triggered, except the reset counters.
    pub struct EstimatorCommand {
        /// The vehicle stands still on the ground: hold velocity at zero.
        on_ground: bool,
        /// Its propellers carry it.
        flying: bool,
        /// The accelerometer does not measure: what it says is no specific force.
        accel_faulty: bool,
        /// A change of this number asks for position and velocity to be set to zero.
        origin_resets: u32,
        /// A change of this number asks for a full new start from calibration.
        full_resets: u32,
    }
}

message! {
    /// What the still-calibration found.
    pub struct CalibrationResult {
        /// Gyro bias, body FRD.
        gyro_bias: Vec3 ["rad/s"],
        /// Mean specific force while still, body FRD: gives the first attitude.
        specific_force: Vec3 ["m/s^2"],
        /// Mean magnetic field while still, body FRD; zero without a magnetometer.
        field: Vec3 ["uT"],
        /// Barometric altitude of the ground.
        baro_altitude: f32 ["m"],
        /// Share of the still period that has been collected, 0 to 1.
        progress: f32,
        /// Finished: the values above may be used.
        complete: bool,
        /// How often motion restarted the collection.
        restarts: u32,
    }
}

message! {
    /// The air, as pitot tube and satellite receiver show it together.
    pub struct AirState {
        /// True airspeed.
        airspeed: f32 ["m/s"],
        /// What a pitot tube at sea level would show: what wings and surfaces feel.
        indicated: f32 ["m/s"],
        /// Velocity of the air, north and east: where it goes.
        wind: [f32; 2] ["m/s"],
        /// One standard deviation of the wind's worse component.
        wind_sigma: f32 ["m/s"],
        /// Is the airspeed the pitot tube's? Otherwise it is the velocity over the ground less the wind that was last known.
        measured: bool,
    }
}
