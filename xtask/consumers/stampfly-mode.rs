//! A stranger's program: a vehicle that becomes ready.

use stampfly_mode::{ModeInput, ModeMachine};
use stampfly_types::Instant;
use stampfly_types::messages::*;

fn main() {
    let estimate = StateEstimate { valid: Validity::ALL, ..Default::default() };
    let calibration = CalibrationResult { complete: true, ..Default::default() };
    let input = ModeInput {
        alerts: Alerts::NONE,
        estimate: &estimate,
        calibration: &calibration,
        land_detected: &LandDetected::default(),
        pilot: None,
        sticks: CommandSource::None,
        commands: &[],
        button: None,
        cut_off: false,
    };
    assert_eq!(ModeMachine::default().step(Instant::from_micros(2_500), &input).flight_status.phase, FlightPhase::IdleGround);
}
