//! What a flight controller is: state and set-point in, thrust and torque out.
//!
//! Everything that differs between control laws lives behind [`Controller`]; everything they agree on (which loops
//! the flight phase, the flight mode and the valid outputs of the estimator call for) is decided once, in
//! [`crate::intent`]. [`CascadeController`](crate::CascadeController) is the default,
//! [`IndiController`](crate::IndiController) the same with an innermost loop that learns at once what else turns the vehicle,
//! [`GeometricController`](crate::GeometricController) the proof that another law fits the same socket.

use stampfly_types::Instant;
use stampfly_types::messages::{CommandSetpoint, ControlOutput, FlightStatus, LandDetected, Setpoint, StateEstimate};

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

/// A control law.
///
/// # Contract
/// * Called once per control period, at 400 Hz by design; `now` never goes backwards.
/// * The output is finite and within the airframe's limits, whatever the input.
/// * Zero thrust and zero torque unless the vehicle is armed and taking off, flying or landing.
/// * Outputs of the estimate whose validity bit is cleared are not used.
pub trait Controller {
    /// One control period.
    fn step(&mut self, now: Instant, input: &ControlInput<'_>) -> ControlOutput;

    /// Forgets integrators and filters. What was learned about the vehicle (its hover thrust) stays.
    fn reset(&mut self);
}
