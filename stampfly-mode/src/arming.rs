//! May the motors be armed, and if not, why not: every reason at once, so that nobody has to guess.

use crate::machine::ModeInput;
use stampfly_types::frame;
use stampfly_types::messages::{Alerts, ArmBlocks, FlightMode, FlightState, Validity};

/// Most tilt on the ground that still allows take-off, rad.
const MAX_TILT: f32 = 0.35;

/// The reasons against arming in this situation; empty when there is none.
///
/// | block | stands for |
/// |---|---|
/// | `CALIBRATING` | still-calibration has not finished |
/// | `NOT_ON_GROUND` | the state is not IDLE on the ground |
/// | `NO_BATTERY`, `LOW_BATTERY` | alerts of the failsafe |
/// | `ATTITUDE`, `TILTED` | tilt unknown or in disagreement with gravity; more than 20° |
/// | `SENSOR` | the inertial sensor is silent |
/// | `ESTIMATE` | the estimate is lost |
/// | `PAIRING` | pairing with a transmitter |
/// | `THROTTLE` | manual throttle is not at rest |
/// | `ARM_SWITCH` | the arm switch has been on since before the vehicle saw it off |
/// | `SELF_TEST` | the self test at power-on failed |
/// | `CRASHED` | a crash nobody has acknowledged by a disarm command or the button |
#[must_use]
pub fn blocks(
    state: FlightState,
    pairing: bool,
    crashed: bool,
    stale_switch: bool,
    input: &ModeInput<'_>,
) -> ArmBlocks {
    let alerts = input.alerts;
    let manual = |mode| matches!(mode, FlightMode::Acro | FlightMode::Stabilize);
    let throttle_up = input.pilot.is_some_and(|pilot| manual(pilot.mode) && pilot.throttle > 0.05);
    ArmBlocks::NONE
        .set(ArmBlocks::CALIBRATING, !input.calibration.complete)
        .set(ArmBlocks::NOT_ON_GROUND, state != FlightState::IdleGround)
        .set(ArmBlocks::NO_BATTERY, alerts.contains(Alerts::USB_POWER))
        .set(ArmBlocks::LOW_BATTERY, alerts.intersects(Alerts::LOW_BATTERY | Alerts::CRITICAL_BATTERY))
        .set(
            ArmBlocks::ATTITUDE,
            !input.estimate.valid.contains(Validity::TILT) || alerts.contains(Alerts::TILT_MISMATCH),
        )
        .set(ArmBlocks::TILTED, frame::tilt(&input.estimate.attitude) > MAX_TILT)
        .set(ArmBlocks::SENSOR, alerts.intersects(Alerts::IMU_DEGRADED | Alerts::IMU_LOST))
        .set(ArmBlocks::ESTIMATE, alerts.contains(Alerts::ESTIMATE_DIVERGED))
        .set(ArmBlocks::SELF_TEST, alerts.contains(Alerts::SELF_TEST_FAILED))
        .set(ArmBlocks::PAIRING, pairing)
        .set(ArmBlocks::THROTTLE, throttle_up)
        .set(ArmBlocks::ARM_SWITCH, stale_switch)
        .set(ArmBlocks::CRASHED, crashed || alerts.intersects(Alerts::IMPACT | Alerts::GYRO_ANOMALY | Alerts::TUMBLED))
}
