<<<<<<< HEAD
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
        .set(ArmBlocks::PAIRING, pairing)
        .set(ArmBlocks::THROTTLE, throttle_up)
        .set(ArmBlocks::ARM_SWITCH, stale_switch)
        .set(ArmBlocks::CRASHED, crashed || alerts.intersects(Alerts::IMPACT | Alerts::GYRO_ANOMALY | Alerts::TUMBLED))
=======
//! May the motors turn? One table of reasons against.
//!
//! Every reason is a bit of [`ArmBlocks`], so "it will not arm" always comes with the answer to "why not". The table is
//! evaluated in every period, not only when somebody asks: a ground station can show the list before the pilot tries.

use stampfly_types::Quat;
use stampfly_types::messages::{Alerts, ArmBlocks, FlightMode, FlightState, GroundContact, Validity};

/// All that speaks for or against arming.
///
/// ```
/// use stampfly_mode::arming::{ArmingFacts, blocks};
/// use stampfly_types::messages::*;
/// let ready = ArmingFacts {
///     state: FlightState::IdleGround, mode: FlightMode::PosHold, contact: GroundContact::Ground, calibrated: true,
///     valid: Validity::ALL, ..Default::default()
/// };
/// assert_eq!(blocks(&ready), ArmBlocks::NONE);
/// let lifted = ArmingFacts { contact: GroundContact::Air, ..ready };
/// assert_eq!(blocks(&lifted).names().collect::<Vec<_>>(), ["NOT_ON_GROUND"]);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ArmingFacts {
    /// The present state.
    pub state: FlightState,
    /// The flight mode that would be flown.
    pub mode: FlightMode,
    /// Contact with the ground.
    pub contact: GroundContact,
    /// Has the still-calibration finished?
    pub calibrated: bool,
    /// Outputs of the estimator that may be used.
    pub valid: Validity,
    /// The attitude.
    pub attitude: Quat,
    /// What the failsafe has found.
    pub alerts: Alerts,
    /// Is a transmitter being paired?
    pub pairing: bool,
    /// The pilot's throttle stick; zero without a pilot.
    pub throttle: f32,
    /// The arm switch is on and has not been seen off.
    pub switch_stuck: bool,
    /// A crash has not been acknowledged.
    pub crashed: bool,
}

/// Take-off is refused beyond this tilt: cosine of 20°.
const COS_TILT_MAX: f32 = 0.939_69;
/// The throttle is at rest within this much of its rest.
const THROTTLE_REST: f32 = 0.1;

/// What the failsafe sees of a crash that is going on.
const CRASH: Alerts = Alerts::IMPACT.with(Alerts::GYRO_ANOMALY).with(Alerts::TUMBLED);

type Check = fn(&ArmingFacts) -> bool;

/// The reasons against arming, and how to find them.
const CHECKS: [(ArmBlocks, Check); 12] = [
    (ArmBlocks::CALIBRATING, |f| !f.calibrated),
    (ArmBlocks::NOT_ON_GROUND, |f| f.state != FlightState::IdleGround || f.contact != GroundContact::Ground),
    (ArmBlocks::NO_BATTERY, |f| f.alerts.intersects(Alerts::USB_POWER)),
    (ArmBlocks::LOW_BATTERY, |f| f.alerts.intersects(Alerts::LOW_BATTERY | Alerts::CRITICAL_BATTERY)),
    (ArmBlocks::ATTITUDE, |f| !f.valid.contains(Validity::TILT) || f.alerts.intersects(Alerts::TILT_MISMATCH)),
    (ArmBlocks::SENSOR, |f| {
        f.alerts.intersects(Alerts::IMU_DEGRADED | Alerts::IMU_LOST)
            || (holds_height(f.mode) && f.alerts.intersects(Alerts::TOF_LOST))
    }),
    (ArmBlocks::ESTIMATE, |f| f.alerts.intersects(Alerts::ESTIMATE_DIVERGED) || !serves(f.valid, f.mode)),
    (ArmBlocks::PAIRING, |f| f.pairing),
    (ArmBlocks::TILTED, |f| cos_tilt(&f.attitude).is_nan() || cos_tilt(&f.attitude) < COS_TILT_MAX),
    (ArmBlocks::THROTTLE, throttle_raised),
    (ArmBlocks::ARM_SWITCH, |f| f.switch_stuck),
    (ArmBlocks::CRASHED, |f| f.crashed || f.alerts.intersects(CRASH)),
];

/// Every reason against arming right now.
#[must_use]
pub fn blocks(facts: &ArmingFacts) -> ArmBlocks {
    let mut found = ArmBlocks::NONE;
    for (block, check) in CHECKS {
        if check(facts) {
            found |= block;
        }
    }
    found
}

/// Can a mode be flown with these outputs of the estimator?
#[must_use]
pub fn serves(valid: Validity, mode: FlightMode) -> bool {
    const HEIGHT: Validity = Validity::TILT.with(Validity::VELOCITY_Z).with(Validity::POSITION_Z);
    match mode {
        FlightMode::Acro => true,
        FlightMode::Stabilize => valid.contains(Validity::TILT),
        FlightMode::AltHold => valid.contains(HEIGHT),
        FlightMode::PosHold => valid.contains(HEIGHT.with(Validity::VELOCITY_XY)),
    }
}

/// Does the vehicle keep its height by itself in this mode?
#[must_use]
pub fn holds_height(mode: FlightMode) -> bool {
    match mode {
        FlightMode::Acro | FlightMode::Stabilize => false,
        FlightMode::AltHold | FlightMode::PosHold => true,
    }
}

/// Cosine of the tilt.
#[must_use]
pub fn cos_tilt(attitude: &Quat) -> f32 {
    1.0 - 2.0 * (attitude.i * attitude.i + attitude.j * attitude.j)
}

/// Rest is the centre where the throttle means climb, and centre or below where it means thrust.
fn throttle_raised(facts: &ArmingFacts) -> bool {
    let off_rest = if holds_height(facts.mode) { facts.throttle.abs() } else { facts.throttle };
    off_rest.is_nan() || off_rest > THROTTLE_REST
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ready() -> ArmingFacts {
        ArmingFacts {
            state: FlightState::IdleGround,
            mode: FlightMode::PosHold,
            calibrated: true,
            valid: Validity::ALL,
            ..ArmingFacts::default()
        }
    }

    #[test]
    fn every_reason_stands_alone() {
        let tilted = Quat::from_euler_angles(0.0, 0.4, 0.0);
        let cases: [(ArmBlocks, ArmingFacts); 19] = [
            (ArmBlocks::NONE, ready()),
            (ArmBlocks::CALIBRATING, ArmingFacts { calibrated: false, ..ready() }),
            (ArmBlocks::NOT_ON_GROUND, ArmingFacts { contact: GroundContact::Air, ..ready() }),
            (ArmBlocks::NOT_ON_GROUND, ArmingFacts { state: FlightState::IdleHeld, ..ready() }),
            (ArmBlocks::NO_BATTERY, ArmingFacts { alerts: Alerts::USB_POWER, ..ready() }),
            (ArmBlocks::LOW_BATTERY, ArmingFacts { alerts: Alerts::LOW_BATTERY, ..ready() }),
            (ArmBlocks::LOW_BATTERY, ArmingFacts { alerts: Alerts::CRITICAL_BATTERY, ..ready() }),
            (ArmBlocks::ATTITUDE, ArmingFacts { alerts: Alerts::TILT_MISMATCH, ..ready() }),
            (
                ArmBlocks::ATTITUDE | ArmBlocks::ESTIMATE,
                ArmingFacts { valid: Validity::ALL.without(Validity::TILT), ..ready() },
            ),
            (ArmBlocks::SENSOR, ArmingFacts { alerts: Alerts::IMU_DEGRADED, ..ready() }),
            (ArmBlocks::SENSOR, ArmingFacts { alerts: Alerts::TOF_LOST, ..ready() }),
            (ArmBlocks::ESTIMATE, ArmingFacts { alerts: Alerts::ESTIMATE_DIVERGED, ..ready() }),
            (ArmBlocks::ESTIMATE, ArmingFacts { valid: Validity::TILT, ..ready() }),
            (ArmBlocks::PAIRING, ArmingFacts { pairing: true, ..ready() }),
            (ArmBlocks::TILTED, ArmingFacts { attitude: tilted, ..ready() }),
            (ArmBlocks::THROTTLE, ArmingFacts { throttle: -0.5, ..ready() }),
            (ArmBlocks::ARM_SWITCH, ArmingFacts { switch_stuck: true, ..ready() }),
            (ArmBlocks::CRASHED, ArmingFacts { crashed: true, ..ready() }),
            (ArmBlocks::CRASHED, ArmingFacts { alerts: Alerts::GYRO_ANOMALY, ..ready() }),
        ];
        for (expected, facts) in cases {
            assert_eq!(blocks(&facts), expected, "{facts:?}");
        }
    }

    #[test]
    fn modes_ask_only_for_what_they_need() {
        let manual = ArmingFacts {
            mode: FlightMode::Stabilize,
            valid: Validity::TILT,
            alerts: Alerts::TOF_LOST | Alerts::FLOW_LOST,
            throttle: -1.0,
            ..ready()
        };
        assert_eq!(blocks(&manual), ArmBlocks::NONE);
        assert_eq!(blocks(&ArmingFacts { throttle: 0.5, ..manual }), ArmBlocks::THROTTLE);
    }

    #[test]
    fn the_table_covers_every_block_and_broken_numbers_block() {
        let covered = CHECKS.iter().fold(ArmBlocks::NONE, |all, (block, _)| all | *block);
        assert_eq!(covered, ArmBlocks::ALL);
        let broken = Quat::new_unchecked(nalgebra::Quaternion::new(f32::NAN, f32::NAN, 0.0, 0.0));
        assert_eq!(blocks(&ArmingFacts { attitude: broken, ..ready() }), ArmBlocks::TILTED);
        assert_eq!(blocks(&ArmingFacts { throttle: f32::NAN, ..ready() }), ArmBlocks::THROTTLE);
        assert!((stampfly_types::math::acos(COS_TILT_MAX).to_degrees() - 20.0).abs() < 0.01);
    }
>>>>>>> control
}
