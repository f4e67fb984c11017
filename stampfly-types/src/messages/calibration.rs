//! Calibration that a person asks for: what is asked, and how far it is.
//!
//! Not the still-calibration after power-on, which nobody asks for: that is [`CalibrationResult`](super::CalibrationResult).

use crate::{message, message_enum};

message_enum! {
    /// What can be calibrated by somebody who holds the vehicle.
    pub enum CalibrationKind {
        /// Nothing; as a request, the end of what is under way.
        #[default]
        None = 0,
        /// Tilt of the inertial sensor in the airframe: standing on a level floor.
        Level = 1,
        /// Accelerometer bias and scale: lying on each of its six faces.
        SixPositions = 2,
        /// Hard and soft iron of the magnetometer: turned every way.
        Magnetometer = 3,
        /// Drift of gyro and accelerometer with temperature: lying still while it warms up.
        Temperature = 4,
    }
}

message_enum! {
    /// Where a calibration is.
    pub enum CalibrationStage {
        /// None was asked for.
        #[default]
        Idle = 0,
        /// Under way.
        Running = 1,
        /// There is a result.
        Done = 2,
        /// It ended without one: cancelled by whoever had asked for it.
        Cancelled = 3,
        /// It ended without one: the vehicle was armed.
        Armed = 4,
        /// It ended without one: it took too long.
        TimedOut = 5,
        /// It ended without one: what was measured is no sensor's.
        Implausible = 6,
    }
}

message_enum! {
    /// What whoever holds the vehicle should do now, and why.
    pub enum CalibrationHint {
        /// Nothing.
        #[default]
        None = 0,
        /// Leave it alone: it moves.
        Moving = 1,
        /// Leave it alone: it is being measured.
        Measuring = 2,
        /// Turn it to another face that is missing.
        Turn = 3,
        /// It lies on no face: it leans by more than 25°.
        NoFace = 4,
        /// This hold contradicts an earlier one of the same face.
        Contradiction = 5,
        /// It does not stand level: it is tilted by more than 5°.
        Tilted = 6,
        /// Turn it on, through every attitude: directions are missing.
        Directions = 7,
        /// Stay away from iron: the field changes with the place.
        Disturbed = 8,
        /// Leave it alone until it is warmer.
        Warming = 9,
        /// The sensor gives no temperature.
        NoTemperature = 10,
        /// The field is too weak or too strong for that of the earth.
        Strength = 11,
    }
}

message! {
    /// Begin a calibration, or end the one that is under way.
    pub struct CalibrationRequest {
        /// Which.
        kind: CalibrationKind,
    }
}

message! {
    /// How far a calibration is, and what it has found.
    pub struct CalibrationReport {
        /// Which.
        kind: CalibrationKind,
        /// Where it is.
        stage: CalibrationStage,
        /// What to do now.
        hint: CalibrationHint,
        /// How much of it is done, 0 to 1.
        progress: f32,
        /// Faces that have been held, by bits: nose, tail, right, left, bottom and top down.
        faces: u32,
        /// What the sensor was off by before: m/s² for six positions, rad for the level, a share of the field for the
        /// magnetometer, rad/s for temperature.
        before: f32 ["SI"],
        /// What remains, in the same unit.
        residual: f32 ["SI"],
        /// What was found, in the order of the parameters; zero behind the last.
        values: [f32; 9] ["SI"],
    }
}
