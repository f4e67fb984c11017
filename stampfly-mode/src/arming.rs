//! May the motors be armed, and if not, why not: every reason at once, so that nobody has to guess.

use crate::config::ModeConfig;
use crate::input::ModeInput;
use stampfly_types::frame;
use stampfly_types::messages::{Alerts, ArmBlocks, FlightPhase, FlightStatus, Validity};

/// Sensors without which nobody takes off.
const SILENT_SENSOR: Alerts =
    Alerts::IMU_DEGRADED.with(Alerts::IMU_LOST).with(Alerts::IMU_FAULTY).with(Alerts::POWER_LOST);

/// The reasons against arming in this situation; empty when there is none.
///
/// | block | stands for |
/// |---|---|
/// | `CALIBRATING` | still-calibration has not finished |
/// | `NOT_ON_GROUND` | the phase is not IDLE on the ground |
/// | `NO_BATTERY`, `LOW_BATTERY` | alerts of the failsafe |
/// | `ATTITUDE`, `TILTED` | tilt unknown or in disagreement with gravity; more than [`ModeConfig::arming_tilt`] |
/// | `SENSOR` | the inertial sensor is silent or does not measure, or the battery monitor is silent |
/// | `ESTIMATE` | the estimate is lost |
/// | `PAIRING` | pairing with a transmitter |
/// | `THROTTLE` | the throttle is above [`ModeConfig::throttle_rest`], and the mode in force or the pilot's makes thrust of it |
/// | `ARM_SWITCH` | the arm switch has been on since before the vehicle saw it off |
/// | `SELF_TEST` | the self test at power-on failed |
/// | `CRASHED` | a crash nobody has acknowledged by a disarm command or the button |
/// | `NO_LINK` | nobody who could stop the vehicle is heard: no pilot, no program |
///
/// State, pairing and the mode in force are read from `mode`.
#[must_use]
pub fn blocks(
    config: &ModeConfig,
    mode: &FlightStatus,
    crashed: bool,
    stale_switch: bool,
    input: &ModeInput<'_>,
) -> ArmBlocks {
    let alerts = input.alerts;
    // The mode in force may be a fallback, and may be left for the pilot's at any time.
    let throttle_up = input.pilot.is_some_and(|pilot| {
        (mode.mode.is_manual() || pilot.mode.is_manual()) && pilot.throttle > config.throttle_rest
    });
    // A command in hand is a sign of life, also when it came after the failsafe looked.
    let silent = alerts.contains(Alerts::COMM_LOST) && input.commands.is_empty();
    ArmBlocks::NONE
        .set(ArmBlocks::CALIBRATING, !input.calibration.complete)
        .set(ArmBlocks::NOT_ON_GROUND, mode.phase != FlightPhase::IdleGround)
        .set(ArmBlocks::NO_BATTERY, alerts.contains(Alerts::USB_POWER))
        .set(ArmBlocks::LOW_BATTERY, alerts.intersects(Alerts::LOW_BATTERY | Alerts::CRITICAL_BATTERY))
        .set(
            ArmBlocks::ATTITUDE,
            !input.estimate.valid.contains(Validity::TILT) || alerts.contains(Alerts::TILT_MISMATCH),
        )
        .set(ArmBlocks::TILTED, frame::tilt(&input.estimate.attitude) > config.arming_tilt)
        .set(ArmBlocks::SENSOR, alerts.intersects(SILENT_SENSOR))
        .set(ArmBlocks::ESTIMATE, alerts.contains(Alerts::ESTIMATE_DIVERGED))
        .set(ArmBlocks::SELF_TEST, alerts.contains(Alerts::SELF_TEST_FAILED))
        .set(ArmBlocks::PAIRING, mode.pairing)
        .set(ArmBlocks::THROTTLE, throttle_up)
        .set(ArmBlocks::ARM_SWITCH, stale_switch)
        .set(ArmBlocks::NO_LINK, silent)
        .set(ArmBlocks::CRASHED, crashed || alerts.intersects(Alerts::IMPACT | Alerts::GYRO_ANOMALY | Alerts::TUMBLED))
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::messages::{
        CalibrationResult, FlightMode, GuidedKind, LandDetected, PilotInput, StateEstimate,
    };

    /// What blocks a vehicle that stands ready.
    fn ready(mode: FlightMode, alerts: Alerts, pilot: Option<&PilotInput>, commands: &[GuidedKind]) -> ArmBlocks {
        let input = ModeInput {
            alerts,
            estimate: &StateEstimate { valid: Validity::ALL, ..Default::default() },
            calibration: &CalibrationResult { complete: true, ..Default::default() },
            land_detected: &LandDetected::default(),
            pilot,
            commands,
            button: None,
        };
        let mode = FlightStatus { phase: FlightPhase::IdleGround, mode, ..Default::default() };
        blocks(&ModeConfig::default(), &mode, false, false, &input)
    }

    #[test]
    fn a_raised_throttle_blocks_where_it_is_thrust_whichever_mode_the_pilot_wants() {
        for &in_force in FlightMode::ALL {
            for &wanted in FlightMode::ALL {
                let pilot = |throttle| PilotInput { throttle, mode: wanted, ..Default::default() };
                let raised = ready(in_force, Alerts::NONE, Some(&pilot(0.6)), &[]);
                let expected = ArmBlocks::NONE.set(ArmBlocks::THROTTLE, in_force.is_manual() || wanted.is_manual());
                assert_eq!(raised, expected, "{in_force:?}, wanted {wanted:?}");
                assert_eq!(ready(in_force, Alerts::NONE, Some(&pilot(0.0)), &[]), ArmBlocks::NONE);
            }
        }
    }

    #[test]
    fn silence_and_silent_sensors_block() {
        let ready = |alerts, commands| ready(FlightMode::PosHold, alerts, None, commands);
        assert_eq!(ready(Alerts::COMM_LOST, &[]), ArmBlocks::NO_LINK);
        assert_eq!(ready(Alerts::COMM_LOST, &[GuidedKind::Arm]), ArmBlocks::NONE, "it is a sign of life itself");
        for sensor in [Alerts::IMU_DEGRADED, Alerts::IMU_LOST, Alerts::POWER_LOST] {
            assert_eq!(ready(sensor, &[GuidedKind::Arm]), ArmBlocks::SENSOR, "{sensor:?}");
        }
    }
}
