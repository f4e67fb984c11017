//! What the mode machine looks at in one step.
//!
//! Everything is borrowed: the caller keeps the newest of each.

use stampfly_types::Instant;
use stampfly_types::messages::{
    Alerts, ButtonGesture, CalibrationResult, CommandSource, GuidedKind, LandDetected, PilotInput, StateEstimate,
};

/// A command from a program or the board, since the last step.
pub type Command = GuidedKind;

/// When the sensors that arming asks for last gave a usable sample; `None` for never.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SensorTimes {
    /// Range to the ground.
    pub range: Option<Instant>,
    /// Optical flow.
    pub flow: Option<Instant>,
    /// Air pressure.
    pub baro: Option<Instant>,
}

impl SensorTimes {
    /// All of them now: for tests and for vehicles whose sensors are checked elsewhere.
    #[must_use]
    pub const fn all(now: Instant) -> Self {
        Self { range: Some(now), flow: Some(now), baro: Some(now) }
    }
}

/// What the machine looks at.
#[derive(Clone, Copy, Debug)]
pub struct ModeInput<'a> {
    /// The failsafe's findings.
    pub alerts: Alerts,
    /// The estimate.
    pub estimate: &'a StateEstimate,
    /// The still-calibration.
    pub calibration: &'a CalibrationResult,
    /// Take-off and landing.
    pub land_detected: &'a LandDetected,
    /// Newest samples of the sensors that arming asks for.
    pub sensors: SensorTimes,
    /// The pilot's newest frame and when it came, if it is fresh.
    pub pilot: Option<(Instant, &'a PilotInput)>,
    /// Whose sticks the controllers follow at present: [`CommandSetpoint::source`](stampfly_types::messages::CommandSetpoint),
    /// and the failsafe's when the set-point is too old.
    pub sticks: CommandSource,
    /// Commands since the last step. Their order does not matter.
    pub commands: &'a [Command],
    /// A gesture on the button since the last step.
    pub button: Option<ButtonGesture>,
    /// The cut-off has stopped the motors.
    pub cut_off: bool,
}
