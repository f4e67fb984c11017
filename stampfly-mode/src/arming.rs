//! May the motors be armed, and if not, why not: every reason at once, each with the value that was found and its limit.

use crate::config::ModeConfig;
use crate::facts::Facts;
use crate::state::{CUT, State};
use stampfly_types::Instant;
use stampfly_types::messages::{Alerts, ArmBlocks, FlightMode, FlightPhase, Validity};

/// A reason against arming.
#[derive(Clone, Copy, Debug)]
pub struct Check {
    /// Its bit.
    pub block: ArmBlocks,
    /// What it refuses, in words: for `docs/reference/modes.md`.
    pub refuses: &'static str,
    /// Unit of value and limit; `""` for a condition, whose value is 1.
    pub unit: &'static str,
    /// The value that was found and its limit, when it refuses.
    test: fn(&ModeConfig, &State, &Facts) -> Option<(f32, f32)>,
}

/// A refusal: which check, what it found, and since when.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Refusal {
    /// The check, as its bit.
    pub check: ArmBlocks,
    /// The value that was found; 1 for a condition.
    pub value: f32,
    /// The limit it is beyond; 0 for a condition.
    pub limit: f32,
    /// Since when.
    pub since: Instant,
}

/// A condition that refuses.
const fn when(refuses: bool) -> Option<(f32, f32)> {
    if refuses { Some((1.0, 0.0)) } else { None }
}

/// A value that must not be above its limit. NaN refuses.
fn above(value: f32, limit: f32) -> Option<(f32, f32)> {
    let allowed = value <= limit;
    if allowed { None } else { Some((value, limit)) }
}

/// Alerts of sensors without which no vehicle takes off.
const SILENT_SENSOR: Alerts = Alerts::IMU_DEGRADED
    .with(Alerts::IMU_LOST)
    .with(Alerts::IMU_FAULTY)
    .with(Alerts::ACCEL_FAULTY)
    .with(Alerts::FORCE_IMPLAUSIBLE)
    .with(Alerts::IMU_NOISY)
    .with(Alerts::POWER_LOST);

macro_rules! checks {
    ($($block:ident [$unit:literal] $refuses:literal => |$config:ident, $state:ident, $facts:ident| $test:expr;)+) => {
        /// Every check, in the order in which refusals are listed.
        pub const CHECKS: &[Check] = &[$(Check {
            block: ArmBlocks::$block,
            refuses: $refuses,
            unit: $unit,
            test: {
                // Not every check looks at everything.
                fn test($config: &ModeConfig, $state: &State, $facts: &Facts) -> Option<(f32, f32)> {
                    let _ = ($config, $state, $facts);
                    $test
                }
                test
            },
        }),+];
    };
}

checks! {
    CUT_OFF [""] "the cut-off has stopped the motors, not acknowledged" => |config, state, facts|
        when(facts.cut_off || state.unacknowledged.contains(ArmBlocks::CUT_OFF));
    CRASHED [""] "a crash, or motors stopped in the air, not acknowledged by arm switch off, `Disarm` or the button" =>
        |config, state, facts| when(state.unacknowledged.contains(ArmBlocks::CRASHED)
            || facts.alerts.intersects(CUT.without(Alerts::IMU_LOST | Alerts::IMU_FAULTY)));
    KILL [""] "the pilot's kill switch is on" => |config, state, facts|
        when(facts.pilot.frame.is_some_and(|(_, input)| input.kill));
    SELF_TEST [""] "the self test at power-on failed" => |config, state, facts|
        when(facts.alerts.contains(Alerts::SELF_TEST_FAILED));
    SENSOR [""] "the inertial sensor is silent or does not measure, or the battery monitor is silent" => |config, state, facts|
        when(facts.alerts.intersects(SILENT_SENSOR));
    CALIBRATING ["1"] "still-calibration has not finished" => |config, state, facts|
        if facts.calibrated { None } else { Some((facts.calibration, 1.0)) };
    ATTITUDE [""] "tilt unknown, or in disagreement with gravity" => |config, state, facts|
        when(!facts.valid.contains(Validity::TILT) || facts.alerts.contains(Alerts::TILT_MISMATCH));
    TILTED ["rad"] "tilted too far" => |config, state, facts| above(facts.tilt, config.arming_tilt);
    ESTIMATE [""] "the estimate is lost, or has no vertical velocity in a mode that holds height" => |config, state, facts|
        when(facts.alerts.contains(Alerts::ESTIMATE_DIVERGED) || (holds_height(state) && !facts.valid.contains(Validity::VELOCITY_Z)));
    NO_RANGE [""] "no usable range, in a mode that holds height" => |config, state, facts|
        when(holds_height(state) && facts.alerts.contains(Alerts::TOF_LOST));
    NO_BARO [""] "no air pressure, in a mode that holds height" => |config, state, facts|
        when(holds_height(state) && facts.alerts.contains(Alerts::BARO_LOST));
    NO_FLOW [""] "no optical flow, in POS_HOLD" => |config, state, facts|
        when(state.wanted.holds_place() && facts.alerts.contains(Alerts::FLOW_LOST));
    MOTOR [""] "a motor turns, as the battery's current shows" => |config, state, facts|
        when(facts.alerts.contains(Alerts::MOTOR_RUNS));
    NO_BATTERY [""] "powered from USB" => |config, state, facts| when(facts.alerts.contains(Alerts::USB_POWER));
    LOW_BATTERY [""] "the battery is low" => |config, state, facts|
        when(facts.alerts.intersects(Alerts::LOW_BATTERY | Alerts::CRITICAL_BATTERY));
    NOT_ON_GROUND [""] "the phase is not IDLE_GROUND" => |config, state, facts| when(state.phase != FlightPhase::IdleGround);
    PAIRING [""] "looking for a transmitter" => |config, state, facts| when(state.pairing.is_some());
    // A command in hand is a sign of life, also when it came after the failsafe looked.
    NO_LINK [""] "neither a pilot nor a program is heard" => |config, state, facts|
        when(facts.alerts.contains(Alerts::COMM_LOST) && !facts.asked.any && state.pairing.is_none());
    ARM_SWITCH [""] "the arm switch has been on since before it was seen off" => |config, state, facts|
        when(facts.pilot.switch.is_stale);
    // The mode in force may be left for the pilot's at any time.
    THROTTLE ["1"] "the throttle is raised, and the mode in force or the pilot's makes thrust of it" => |config, state, facts| {
        let thrust = |pilot: FlightMode| state.mode.is_manual() || pilot.is_manual();
        facts.pilot.frame.filter(|(_, input)| thrust(input.mode)).and_then(|(_, input)| above(input.throttle, config.throttle_rest))
    };
}

fn holds_height(state: &State) -> bool {
    !state.wanted.is_manual()
}

/// The reasons against arming; empty when there is none.
#[must_use]
pub fn blocks(config: &ModeConfig, state: &State, facts: &Facts) -> ArmBlocks {
    let refuses = |check: &&Check| (check.test)(config, state, facts).is_some();
    CHECKS.iter().filter(refuses).fold(ArmBlocks::NONE, |blocks, check| blocks | check.block)
}

/// Remembers since when each check has refused.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Refusals {
    since: [Option<Instant>; CHECKS.len()],
    found: [(f32, f32); CHECKS.len()],
}

impl Refusals {
    pub fn step(&mut self, config: &ModeConfig, state: &State, facts: &Facts) {
        for ((check, since), found) in CHECKS.iter().zip(&mut self.since).zip(&mut self.found) {
            let result = (check.test)(config, state, facts);
            *since = result.map(|_| since.unwrap_or(facts.now));
            *found = result.unwrap_or_default();
        }
    }

    pub fn iter(&self) -> impl Iterator<Item = Refusal> {
        let found = CHECKS.iter().zip(&self.since).zip(&self.found);
        found.filter_map(|((check, since), (value, limit))| {
            Some(Refusal { check: check.block, value: *value, limit: *limit, since: (*since)? })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::facts::Asked;
    use crate::pilot::Heard;
    use stampfly_types::messages::PilotInput;

    fn ready(mode: FlightMode) -> (State, Facts) {
        let state = State { phase: FlightPhase::IdleGround, wanted: mode, mode, ..State::default() };
        (state, Facts { valid: Validity::ALL, calibrated: true, ..Facts::default() })
    }

    fn found(state: &State, facts: &Facts) -> ArmBlocks {
        blocks(&ModeConfig::default(), state, facts)
    }

    #[test]
    fn every_block_has_one_check() {
        let bits = CHECKS.iter().fold(ArmBlocks::NONE, |bits, check| {
            assert!(!bits.intersects(check.block), "{:?} twice", check.block);
            bits | check.block
        });
        assert_eq!(bits, ArmBlocks::ALL);
        assert_eq!(CHECKS.len(), ArmBlocks::NAMES.len());
    }

    #[test]
    fn a_raised_throttle_blocks_where_it_is_thrust_whichever_mode_the_pilot_wants() {
        for &in_force in FlightMode::ALL {
            for &wanted in FlightMode::ALL {
                let (state, mut facts) = ready(in_force);
                for throttle in [0.0, 0.6] {
                    let frame = PilotInput { throttle, mode: wanted, ..Default::default() };
                    facts.pilot = Heard { frame: Some((Instant::ZERO, frame)), ..Heard::default() };
                    let thrust = throttle > 0.0 && (in_force.is_manual() || wanted.is_manual());
                    let expected = ArmBlocks::NONE.set(ArmBlocks::THROTTLE, thrust);
                    assert_eq!(found(&state, &facts), expected, "{in_force:?}, wanted {wanted:?}");
                }
            }
        }
    }

    #[test]
    fn silence_and_silent_sensors_block() {
        let (state, facts) = ready(FlightMode::PosHold);
        let silent = Facts { alerts: Alerts::COMM_LOST, ..facts };
        assert_eq!(found(&state, &silent), ArmBlocks::NO_LINK);
        let spoken = Facts { asked: Asked { any: true, ..Asked::default() }, ..silent };
        assert_eq!(found(&state, &spoken), ArmBlocks::NONE, "a command is a sign of life itself");
        for sensor in [Alerts::IMU_DEGRADED, Alerts::IMU_LOST, Alerts::IMU_NOISY, Alerts::POWER_LOST] {
            assert_eq!(found(&state, &Facts { alerts: sensor, ..facts }), ArmBlocks::SENSOR, "{sensor:?}");
        }
        let runs = Facts { alerts: Alerts::MOTOR_RUNS, ..facts };
        assert_eq!(found(&state, &runs), ArmBlocks::MOTOR, "a motor that turns by itself");
        let pairing = State { pairing: Some(Instant::ZERO), ..state };
        assert_eq!(found(&pairing, &silent), ArmBlocks::PAIRING, "d16: no other transmitter is to be heard");
    }

    #[test]
    fn d9_arming_asks_for_the_sensors_of_the_mode_and_names_them() {
        let (range, flow, baro) = (ArmBlocks::NO_RANGE, ArmBlocks::NO_FLOW, ArmBlocks::NO_BARO);
        for (mode, needed) in [
            (FlightMode::PosHold, range | flow | baro),
            (FlightMode::AltHold, range | baro),
            (FlightMode::Stabilize, ArmBlocks::NONE),
            (FlightMode::Acro, ArmBlocks::NONE),
        ] {
            let (state, facts) = ready(mode);
            for (alerts, missing) in [
                (Alerts::NONE, ArmBlocks::NONE),
                (Alerts::TOF_LOST, range),
                (Alerts::FLOW_LOST, flow),
                (Alerts::BARO_LOST, baro),
            ] {
                let expected = if needed.contains(missing) { missing } else { ArmBlocks::NONE };
                assert_eq!(found(&state, &Facts { alerts, ..facts }), expected, "{mode:?}");
            }
        }
    }

    #[test]
    fn a_refusal_names_value_limit_and_since() {
        let config = ModeConfig::default();
        let (state, mut facts) = ready(FlightMode::Stabilize);
        let mut refusals = Refusals::default();
        for second in 0..4 {
            facts.now = Instant::from_secs(second);
            facts.tilt = [0.0, 0.5, f32::NAN, 0.6][second as usize];
            refusals.step(&config, &state, &facts);
            assert_eq!(refusals.iter().count(), usize::from(second > 0));
        }
        let expected =
            Refusal { check: ArmBlocks::TILTED, value: 0.6, limit: config.arming_tilt, since: Instant::from_secs(1) };
        assert_eq!(refusals.iter().next(), Some(expected));
    }
}
