//! The quadcopter's state in the words of the family, so that its services (MSP, MAVLink, pages) read it like any other vehicle's.
//!
//! It knows its attitude and rates, and nothing of where it is: those numbers are zero and marked as not valid.

use crate::messages::{Attitude, ControlState, ReceiverInput};
use crate::protection::CUT;
use stampfly_types::messages::*;

/// Where it is between power-on and landing, as far as it can tell: with motors that turn it flies.
#[must_use]
pub fn status(state: &ControlState, attitude: Option<&Attitude>, turning: bool, alerts: Alerts) -> FlightStatus {
    let blocks = [
        (ArmBlocks::CRASHED, alerts.intersects(CUT)),
        (ArmBlocks::SENSOR, attitude.is_none()),
        (ArmBlocks::CALIBRATING, state.calibrating),
        (ArmBlocks::NO_LINK, !state.online),
    ];
    FlightStatus {
        phase: match (state.armed, turning) {
            (true, true) => FlightPhase::Flying,
            (true, false) => FlightPhase::Armed,
            (false, _) if attitude.is_none() => FlightPhase::Init,
            (false, _) => FlightPhase::IdleGround,
        },
        mode: mode(state),
        armed: state.armed,
        commander: if state.armed { CommandSource::Pilot } else { CommandSource::None },
        blocks: blocks.iter().fold(ArmBlocks::NONE, |all, (block, holds)| all.set(*block, *holds)),
        ..FlightStatus::default()
    }
}

/// Attitude and rates.
#[must_use]
pub fn estimate(attitude: Option<&Attitude>) -> StateEstimate {
    let Some(known) = attitude else { return StateEstimate::default() };
    StateEstimate {
        attitude: known.attitude,
        angular_rate: known.rate,
        specific_force: known.accel,
        valid: Validity::NONE.set(Validity::TILT, true).set(Validity::HEADING, true),
        sensors: SensorMask::NONE.set(SensorMask::IMU, true),
        ..StateEstimate::default()
    }
}

/// The sticks, centred at zero.
#[must_use]
pub fn pilot(input: &ReceiverInput, state: &ControlState) -> PilotInput {
    let stick = |share: f32| 2.0 * share - 1.0;
    PilotInput {
        roll: stick(input.roll),
        // There forward is positive, here nose up.
        pitch: -stick(input.pitch),
        yaw: stick(input.yaw),
        throttle: stick(input.throttle),
        mode: mode(state),
        arm: state.armed,
        kill: false,
    }
}

const fn mode(state: &ControlState) -> FlightMode {
    if state.angle_mode { FlightMode::Stabilize } else { FlightMode::Acro }
}
