//! What the mode machine looks at in one step.
//!
//! Everything is borrowed: the caller keeps the newest of each.

use stampfly_types::Instant;
use stampfly_types::messages::{
    Alerts, ButtonGesture, CalibrationResult, CommandSource, GuidedKind, LandDetected, PilotInput, StateEstimate,
};

/// A command from a program or the board, since the last step.
pub type Command = GuidedKind;

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
