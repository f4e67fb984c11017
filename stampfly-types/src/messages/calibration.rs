//! Messages of calibrations that an operator starts: requests and progress.
//!
//! Not for the calibration at rest after power-on, which starts by itself: see
//! [`CalibrationResult`](super::CalibrationResult).

use crate::{message, message_enum};

message_enum! {
    /// A calibration for which an operator handles the vehicle.
    pub enum CalibrationKind {
        /// None; in a request: end the calibration in progress.
        #[default]
        None = 0,
        /// Tilt of the inertial sensor in the airframe: standing on a level floor.
        Level = 1,
        /// Accelerometer bias and scale: resting on each of its six faces.
        SixPositions = 2,
        /// Hard and soft iron of the magnetometer: turned through all attitudes.
        Magnetometer = 3,
        /// Drift of gyro and accelerometer with temperature: at rest while it warms up.
        Temperature = 4,
    }
}

message_enum! {
    /// Progress of a calibration.
    pub enum CalibrationStage {
        /// No calibration was requested.
        #[default]
        Idle = 0,
        /// In progress.
        Running = 1,
        /// Finished with a result.
        Done = 2,
        /// Ended without a result: cancelled by a request.
        Cancelled = 3,
        /// Ended without a result: the vehicle was armed.
        Armed = 4,
        /// Ended without a result: it took too long.
        TimedOut = 5,
        /// Ended without a result: the measurements are implausible for this sensor.
        Implausible = 6,
    }
}

message_enum! {
    /// Instruction for the operator, and its reason.
    pub enum CalibrationHint {
        /// Nothing.
        #[default]
        None = 0,
        /// Keep the vehicle still: it moves.
        Moving = 1,
        /// Keep the vehicle still: it is being measured.
        Measuring = 2,
        /// Turn the vehicle to a face that is still missing.
        Turn = 3,
        /// The vehicle does not rest on a face: it leans by more than 25°.
        NoFace = 4,
        /// This measurement contradicts an earlier one of the same face.
        Contradiction = 5,
        /// The vehicle is not level: it is tilted by more than 5°.
        Tilted = 6,
        /// Continue to turn the vehicle through all attitudes: directions are missing.
        Directions = 7,
        /// Move away from iron: the field changes with the position.
        Disturbed = 8,
        /// Keep the vehicle still until it is warmer.
        Warming = 9,
        /// The sensor provides no temperature.
        NoTemperature = 10,
        /// The field is weaker or stronger than the Earth's.
        Strength = 11,
    }
}

message! {
    /// Start a calibration, or end the one in progress.
    pub struct CalibrationRequest {
        /// The calibration to start.
        kind: CalibrationKind,
    }
}

message! {
    /// Progress and result of a calibration.
    pub struct CalibrationReport {
        /// The calibration it reports on.
        kind: CalibrationKind,
        /// Progress as a stage.
        stage: CalibrationStage,
        /// Next step of the operator.
        hint: CalibrationHint,
        /// Completed share, 0 to 1.
        progress: f32,
        /// Faces that have been measured, one bit each from bit 0: nose, tail, right, left, bottom
        /// and top down.
        faces: u32,
        /// Error of the sensor before the calibration: m/s² for six positions, rad for the level, a
        /// share of the field for the magnetometer, rad/s for temperature.
        before: f32 ["SI"],
        /// Error that remains after the calibration, in the same unit.
        residual: f32 ["SI"],
        /// Calibration values, in the order of the parameters; unused entries are zero.
        values: [f32; 9] ["SI"],
    }
}
