//! The messages of the flight stack, from sensor to motor.
//!
//! | group | messages |
//! |---|---|
//! | [`sensor`] | [`ImuData`] [`TofData`] [`FlowData`] [`MagData`] [`BaroData`] [`ExternalPose`] [`PowerData`] [`GnssData`] [`AirspeedData`] |
//! | [`estimate`] | [`StateEstimate`] [`EstimatorStatus`] [`EstimatorCommand`] [`CalibrationResult`] [`AirState`] |
//! | [`health`] | [`SensorFindings`] [`EstimateCorrection`] |
//! | [`calibration`] | [`CalibrationRequest`] [`CalibrationReport`] |
//! | [`command`] | [`PilotInput`] [`GuidedCommand`] [`ButtonEvent`] [`CommandSetpoint`] [`Setpoint`] |
//! | [`control`] | [`ControlOutput`] [`MotorOutput`] [`ServoOutput`] |
//! | [`system`] | [`FlightStatus`] [`ArmRefusals`] [`SystemAlert`] [`LandDetected`] [`SelfTest`] [`Signal`] |
//!
//! No message contains a time stamp: the bus stamps every sample with the instant its data is valid
//! for.

pub mod calibration;
pub mod command;
pub mod control;
pub mod estimate;
mod garbled;
pub mod health;
pub mod sensor;
pub mod system;

pub use calibration::{CalibrationHint, CalibrationKind, CalibrationReport, CalibrationRequest, CalibrationStage};
pub use command::{
    ButtonEvent, ButtonGesture, CommandSetpoint, FlipDirection, GuidedCommand, GuidedKind, PilotInput, Setpoint,
    SetpointAxes, stick,
};
pub use control::{ControlOutput, MAX_MOTORS, MAX_SERVOS, MotorOutput, ServoOutput};
pub use estimate::{
    AirState, CalibrationResult, EstimatorCommand, EstimatorStatus, SensorMask, StateEstimate, Validity,
};
pub use health::{EstimateCorrection, Finding, Health, SensorFindings};
pub use sensor::{
    AirspeedData, BaroData, ExternalPose, FlowData, GnssData, GnssFix, ImuData, MagData, PowerData, TofData,
};
pub use system::{
    Alerts, ArmBlocks, ArmRefusals, CommandSource, FlightMode, FlightPhase, FlightStatus, FlipBlocks, GroundContact,
    LandDetected, SelfTest, SelfTestVerdict, Signal, SystemAlert, Tone,
};
