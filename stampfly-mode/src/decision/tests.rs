//! Every state with every relevant alert and every set of up to three events: what must hold whatever happens.

use super::*;
use crate::facts::Asked;
use crate::pilot::{Heard, Switched};
use crate::transitions::TABLE;
use stampfly_types::messages::PilotInput;
use std::collections::BTreeSet;
use std::vec;
use std::vec::Vec;

/// Something that happens in a step.
type Happening = (&'static str, fn(&mut Facts));

fn frame(facts: &mut Facts) -> &mut PilotInput {
    &mut facts.pilot.frame.get_or_insert((facts.now, PilotInput { mode: FlightMode::PosHold, ..Default::default() })).1
}

const HAPPENINGS: &[Happening] = &[
    ("Kill", |f| f.asked.kill = true),
    ("Disarm", |f| f.asked.disarm = true),
    ("Land", |f| f.asked.land = true),
    ("TakeOff", |f| f.asked.take_off = true),
    ("Arm", |f| f.asked.arm = true),
    ("WayPoint", |f| f.asked.route = true),
    ("Flip", |f| f.asked.flip = true),
    ("pilot's kill", |f| frame(f).kill = true),
    ("switch on", |f| f.pilot.switch.rises = true),
    ("switch off", |f| f.pilot.switch.falls = true),
    ("switch found off", |f| f.pilot.switch.found_off = true),
    ("mode switch to STABILIZE", |f| (f.pilot.mode_turned, f.pilot.mode) = (true, Some(FlightMode::Stabilize))),
    ("stick moved", |f| f.pilot.deflected = true),
    ("throttle up", |f| frame(f).throttle = 0.8),
    ("press that stops", |f| f.stop_button = true),
    ("press", |f| f.button = Some(ButtonGesture::Press)),
    ("click", |f| f.button = Some(ButtonGesture::Click)),
    ("hold", |f| f.button = Some(ButtonGesture::HoldPair)),
    ("cut-off", |f| f.cut_off = true),
    ("touchdown", |f| f.landed = true),
    ("take-off complete", |f| f.takeoff_complete = true),
    ("sticks lost", |f| f.sticks = CommandSource::Failsafe),
    ("height lost", |f| f.valid = Validity::TILT),
];

const ALERTS: [Alerts; 9] = [
    Alerts::NONE,
    Alerts::COMM_LOST,
    Alerts::IMPACT,
    Alerts::GYRO_ANOMALY,
    Alerts::TUMBLED,
    Alerts::IMU_LOST,
    Alerts::IMU_FAULTY,
    Alerts::CRITICAL_BATTERY,
    Alerts::ESTIMATE_DIVERGED,
];

fn kills(facts: &Facts) -> bool {
    facts.asked.kill
        || facts.stop_button
        || facts.cut_off
        || facts.alerts.intersects(CUT)
        || facts.pilot.frame.is_some_and(|(_, input)| input.kill)
}

/// States that differ in all that decides.
fn states() -> Vec<State> {
    let mut states = vec![];
    for &phase in FlightPhase::ALL {
        for wanted in [FlightMode::Stabilize, FlightMode::PosHold] {
            for commander in [CommandSource::None, CommandSource::Pilot, CommandSource::Guided] {
                for landing_by_switch in [false, true] {
                    for silent_for in [None, Some(1), Some(3)] {
                        let silence = silent_for
                            .map(|seconds| Silence { since: Instant::from_secs(100 - seconds), heard_since: None });
                        states.push(State {
                            phase,
                            wanted,
                            mode: wanted,
                            commander,
                            landing_by_switch,
                            silence,
                            entered: Instant::from_secs(95),
                            landing_limit: Duration::from_secs(60),
                            takes_off: landing_by_switch,
                            throttle_rested: true,
                            ..State::default()
                        });
                    }
                }
            }
        }
    }
    states
}

/// A vehicle that could be armed, or flies at 1.5 m.
fn quiet(state: &State) -> Facts {
    let airborne = is_airborne(state.phase);
    Facts {
        now: Instant::from_secs(100),
        valid: Validity::ALL,
        height: if airborne || state.phase == FlightPhase::IdleHeld { 1.5 } else { 0.03 },
        contact: if airborne { GroundContact::Air } else { GroundContact::Ground },
        upright: 1.0,
        at_rest: true,
        calibrated: true,
        sticks: state.commander,
        ..Facts::default()
    }
}

#[test]
fn exhaustive_single_step() {
    let config = ModeConfig { flip_height: 1.0, ..ModeConfig::default() };
    let (mut seen, mut decisions) = (BTreeSet::new(), 0u32);
    for state in states() {
        for alerts in ALERTS {
            let base = Facts { alerts, ..quiet(&state) };
            for (i, a) in HAPPENINGS.iter().enumerate() {
                for (j, b) in HAPPENINGS.iter().enumerate().skip(i) {
                    for c in &HAPPENINGS[j..] {
                        let mut facts = base;
                        for (_, happen) in [a, b, c] {
                            happen(&mut facts);
                        }
                        let next_state = decide(&config, &state, &facts);
                        decisions += 1;
                        let why = || std::format!("{state:?} with {alerts:?}, {}, {}, {}", a.0, b.0, c.0);
                        seen.insert((state.phase, next_state.phase));
                        check(&config, &state, &facts, &next_state, &why);
                    }
                }
            }
        }
    }
    assert!(decisions > 1_000_000, "{decisions}");
    let table: BTreeSet<_> =
        TABLE.iter().map(|row| (row.from, row.to)).filter(|(from, _)| *from != FlightPhase::IdleHeld).collect();
    let moved: BTreeSet<_> =
        seen.into_iter().filter(|(from, to)| from != to && *from != FlightPhase::IdleHeld).collect();
    let missed: Vec<_> = table.difference(&moved).filter(|(_, to)| *to != FlightPhase::IdleHeld).collect();
    assert!(missed.is_empty(), "never taken: {missed:?}");
}

fn check(config: &ModeConfig, state: &State, facts: &Facts, next_state: &State, why: &dyn Fn() -> std::string::String) {
    let (armed_before, armed) = (state.is_armed(), next_state.is_armed());
    if kills(facts) {
        assert!(!armed, "a kill lost: {}", why());
    }
    if armed && !armed_before {
        let asked = facts.asked.arm || facts.pilot.switch.rises || facts.button == Some(ButtonGesture::Click);
        assert!(asked && state.phase == FlightPhase::IdleGround, "armed unasked: {}", why());
        let ends = facts.asked.disarm || facts.asked.land || facts.pilot.switch.falls;
        assert!(!ends, "arming won: {}", why());
        assert!(facts.alerts.is_empty() || facts.asked.any || !facts.alerts.contains(Alerts::COMM_LOST), "{}", why());
    }
    let legal = TABLE.iter().any(|row| row.from == state.phase && row.to == next_state.phase);
    assert!(legal || state.phase == next_state.phase, "not in the table: {}", why());
    if is_airborne(state.phase) {
        let stopped = !armed && !kills(facts) && !facts.landed;
        if stopped {
            let manual = state.mode.is_manual() && facts.pilot.switch.falls;
            let second = state.phase == FlightPhase::Landing && state.landing_by_switch && facts.pilot.switch.falls;
            assert!(manual || second, "motors stopped in the air: {}", why());
            assert!(!next_state.unacknowledged.is_empty(), "not to be acknowledged: {}", why());
        }
        let turned = facts.pilot.mode_turned || state.pending.is_some();
        if next_state.mode.is_manual() && !state.mode.is_manual() {
            assert!(turned, "the stick became thrust: {}", why());
        }
        let holds = next_state.phase == FlightPhase::Flying && next_state.mode.is_manual();
        assert!(!holds || facts.sticks == CommandSource::Pilot, "thrust of a stick that is not heard: {}", why());
        let ends = facts.asked.land || facts.asked.disarm || facts.pilot.switch.falls || facts.pilot.switch.found_off;
        if ends && armed && state.phase != FlightPhase::Landing {
            assert_eq!(next_state.phase, FlightPhase::Landing, "{}", why());
        }
    }
    if next_state.phase == FlightPhase::Flip && state.phase != FlightPhase::Flip {
        assert!(facts.asked.flip && state.phase == FlightPhase::Flying, "turned over unasked: {}", why());
        assert!(!next_state.mode.is_manual() && !facts.alerts.intersects(NO_FLIP), "turned over: {}", why());
        assert_eq!(next_state.commander, CommandSource::Guided, "{}", why());
    }
    let acts = facts.pilot.deflected || facts.pilot.mode_turned || facts.pilot.switch.rises || facts.pilot.switch.falls;
    if armed_before && armed && next_state.commander == CommandSource::Pilot && state.commander != CommandSource::Pilot
    {
        assert!(acts, "taken over by being heard: {}", why());
    }
    assert_eq!(*next_state, decide(config, state, facts), "a function");
}

/// Left alone with nothing but the passing of time, every state ends disarmed; so does every one whose link is lost.
#[test]
fn every_state_ends_disarmed() {
    let config = ModeConfig::default();
    for start in states().into_iter().filter(State::is_armed) {
        for (alerts, valid) in [
            (Alerts::COMM_LOST, Validity::ALL),
            (Alerts::COMM_LOST, Validity::TILT),
            (Alerts::CRITICAL_BATTERY, Validity::ALL),
        ] {
            let (mut state, mut facts) = (start, Facts { alerts, valid, ..quiet(&start) });
            let ended = (0..10_000).find(|_| {
                facts.now += Duration::from_millis(20);
                state = decide(&config, &state, &facts);
                !state.is_armed()
            });
            assert!(ended.is_some(), "{start:?} with {alerts:?}");
        }
    }
}

/// Turning over, from the command to the flight that goes on.
#[test]
fn a_flip_is_begun_and_ended_by_what_is_seen_of_it() {
    let config = ModeConfig { flip_height: 1.0, ..ModeConfig::default() };
    let flying = State {
        phase: FlightPhase::Flying,
        wanted: FlightMode::PosHold,
        mode: FlightMode::PosHold,
        commander: CommandSource::Guided,
        ..State::default()
    };
    let asked = Facts { asked: Asked { flip: true, any: true, ..Asked::default() }, ..quiet(&flying) };
    let turning = decide(&config, &flying, &asked);
    assert_eq!((turning.phase, turning.inverted), (FlightPhase::Flip, false));
    for refused in [
        Facts { height: 0.9, ..asked },
        Facts { valid: Validity::ALL.without(Validity::HEIGHT), ..asked },
        Facts { alerts: Alerts::LOW_BATTERY, ..asked },
        Facts { upright: 0.9, ..asked },
        Facts { at_rest: false, ..asked },
    ] {
        assert_eq!(decide(&config, &flying, &refused).phase, FlightPhase::Flying, "{refused:?}");
    }
    let sticks = Facts { pilot: Heard { deflected: true, ..Heard::default() }, ..asked };
    assert_eq!(decide(&config, &flying, &sticks).phase, FlightPhase::Flying, "the pilot flies");
    assert_eq!(
        decide(&ModeConfig::default(), &flying, &asked).phase,
        FlightPhase::Flying,
        "a vehicle nothing is known of"
    );

    let later = |millis| Instant::from_secs(100) + Duration::from_millis(millis);
    let level = quiet(&turning);
    // Level before it has been upside down is the climb; then it has given up.
    assert_eq!(decide(&config, &turning, &Facts { now: later(300), ..level }).phase, FlightPhase::Flip);
    assert_eq!(decide(&config, &turning, &Facts { now: later(1_300), ..level }).phase, FlightPhase::Flying);
    let inverted = decide(&config, &turning, &Facts { now: later(500), upright: -0.5, at_rest: false, ..level });
    assert!(inverted.phase == FlightPhase::Flip && inverted.inverted);
    let falls = Facts { now: later(800), at_rest: false, ..level };
    assert_eq!(decide(&config, &inverted, &falls).phase, FlightPhase::Flip);
    assert_eq!(decide(&config, &inverted, &Facts { at_rest: true, ..falls }).phase, FlightPhase::Flying);
    assert_eq!(decide(&config, &inverted, &Facts { now: later(5_000), ..falls }).phase, FlightPhase::Flying, "stuck");
    let land = Facts { asked: Asked { land: true, any: true, ..Asked::default() }, ..falls };
    assert_eq!(decide(&config, &inverted, &land).phase, FlightPhase::Landing);
}

/// A flight that goes on is the one state without a time-out, and INIT waits for its sensors: a vehicle without them must not
/// go anywhere.
#[test]
fn every_phase_has_an_exit() {
    for phase in FlightPhase::ALL {
        assert!(TABLE.iter().any(|row| row.from == *phase), "{phase:?}");
        let rows = || TABLE.iter().filter(|row| row.from == *phase);
        let events: BTreeSet<_> = rows().map(|row| std::format!("{:?}", row.event)).collect();
        assert_eq!(events.len(), rows().count(), "one way for every event of {phase:?}");
        assert!(!is_armed(*phase) || rows().any(|row| row.event == Event::Emergency), "{phase:?}");
    }
}

#[test]
fn pilot_facts_default_to_silence() {
    assert_eq!(Heard::default().switch, Switched::default());
    assert_eq!(Asked::read(&[]), Asked::default());
}
