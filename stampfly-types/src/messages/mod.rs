//! The messages of the flight stack, from sensor to motor.
//!
//! | group | messages |
//! |---|---|
//! | [`sensor`] | [`ImuData`] [`TofData`] [`FlowData`] [`MagData`] [`BaroData`] [`ExternalPose`] [`PowerData`] |
//! | [`estimate`] | [`StateEstimate`] [`EstimatorStatus`] [`EstimatorCommand`] [`CalibrationResult`] |
//! | [`command`] | [`PilotInput`] [`GuidedCommand`] [`ButtonEvent`] [`CommandSetpoint`] [`Setpoint`] |
//! | [`control`] | [`ControlOutput`] [`MotorOutput`] |
//! | [`system`] | [`FlightStatus`] [`ArmRefusals`] [`SystemAlert`] [`LandDetected`] [`SelfTest`] [`Signal`] |
//!
//! No message carries a time stamp: the bus stamps every sample with the instant its data is valid for.

pub mod command;
pub mod control;
pub mod estimate;
mod garbled;
pub mod sensor;
pub mod system;

pub use command::{
    ButtonEvent, ButtonGesture, CommandSetpoint, FlipDirection, GuidedCommand, GuidedKind, PilotInput, Setpoint,
    SetpointAxes, stick,
};
pub use control::{ControlOutput, MAX_MOTORS, MotorOutput};
pub use estimate::{CalibrationResult, EstimatorCommand, EstimatorStatus, SensorMask, StateEstimate, Validity};
pub use sensor::{BaroData, ExternalPose, FlowData, ImuData, MagData, PowerData, TofData};
pub use system::{
    Alerts, ArmBlocks, ArmRefusals, CommandSource, FlightMode, FlightPhase, FlightStatus, GroundContact, LandDetected,
    SelfTest, SelfTestVerdict, Signal, SystemAlert, Tone,
};
