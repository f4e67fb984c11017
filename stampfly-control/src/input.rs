//! What a controller may look at in one step. A plain struct of references, made anew in every period; nothing is kept of it.

use stampfly_types::messages::{CommandSetpoint, FlightStatus, LandDetected, Setpoint, StateEstimate};

/// All a controller may look at in one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlInput<'a> {
    /// Where the vehicle is, and which parts of that may be believed.
    pub estimate: &'a StateEstimate,
    /// The sticks, for the modes in which they command angles or rates.
    pub command: &'a CommandSetpoint,
    /// Where the vehicle should be.
    pub setpoint: &'a Setpoint,
    /// Flight phase and mode. A change of `control_resets` resets the controller.
    pub flight_status: &'a FlightStatus,
    /// Contact with the ground and the thrust ceiling while landing.
    pub land_detected: &'a LandDetected,
    /// What the mixer could not deliver in the previous step ([`Mixed::unmet`](crate::Mixed)).
    pub unmet: [f32; 4],
}
