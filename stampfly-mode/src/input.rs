//! What the mode machine looks at in one step, and the reasons against arming with it.
//!
//! Everything is borrowed: whoever steps the machine keeps the newest of each.

use stampfly_types::messages::{
    Alerts, ButtonGesture, CalibrationResult, GuidedKind, LandDetected, PilotInput, StateEstimate,
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
    /// The pilot's newest frame, if it is fresh.
    pub pilot: Option<&'a PilotInput>,
    /// Commands since the last step, in order.
    pub commands: &'a [Command],
    /// A gesture on the button since the last step.
    pub button: Option<ButtonGesture>,
}
