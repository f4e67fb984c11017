//! A take-off that leans by more than the tilt integrals hold.

use stampfly_control::{Airframe, CascadeConfig, CascadeController, ControlInput, Controller};
use stampfly_types::messages::{
    CommandSetpoint, FlightMode, FlightPhase, FlightStatus, GroundContact, LandDetected, Setpoint, SetpointAxes,
    StateEstimate, Validity,
};
use stampfly_types::{Instant, Quat, Vec3};

/// Lean to the right that does not change for half a second, rad: 11°.
const LEAN: f32 = 0.19;

/// By how much the torque about roll changes meanwhile, N·m, while the vehicle has this phase and the
/// stick asks for this roll.
fn change(phase: FlightPhase, roll: f32) -> f32 {
    let mut controller = CascadeController::new(&CascadeConfig::for_airframe(&Airframe::EXAMPLE));
    let attitude = Quat::from_axis_angle(&Vec3::x(), LEAN);
    let estimate = StateEstimate { attitude, valid: Validity::ALL, ..StateEstimate::default() };
    let flight_status = FlightStatus { phase, mode: FlightMode::AltHold, armed: true, ..FlightStatus::default() };
    let land_detected = LandDetected { contact: GroundContact::Air, thrust_ceiling: 1.3, ..LandDetected::default() };
    let setpoint = Setpoint { axes: SetpointAxes::POSITION_Z, ..Setpoint::default() };
    let input = ControlInput {
        estimate: &estimate,
        command: &CommandSetpoint { roll, ..CommandSetpoint::default() },
        setpoint: &setpoint,
        flight_status: &flight_status,
        land_detected: &land_detected,
        unmet: [0.0; 4],
    };
    let mut torque = |step: u64| controller.step(Instant::from_micros(2_500 * step), &input).torque.x;
    let torques: Vec<_> = (1..=200).map(&mut torque).collect();
    torques[199] - torques[20]
}

#[test]
fn its_torque_is_found_unless_a_stick_asks_for_a_lean() {
    assert!(change(FlightPhase::TakeOff, 0.0) < -1e-5, "it is turned back ever more");
    assert_eq!(change(FlightPhase::TakeOff, -0.3), 0.0, "a hand may hold it");
    assert_eq!(change(FlightPhase::Flying, 0.0), 0.0, "as in the air");
}
