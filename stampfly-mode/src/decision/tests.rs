//! Every state with every alert, every pair of alerts and every set of up to three events: what must hold whatever happens.
//!
//! Motors are those of the output stage that flies, `stampfly-control`'s, behind the decision.

use super::*;
use crate::facts::Asked;
use crate::pilot::{Heard, Switched};
use crate::transitions::TABLE;
use stampfly_control::{Airframe, Mixed, MotorConfig, MotorStage};
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
    ("Kill", |f| (f.asked.kill, f.asked.any) = (true, true)),
    ("Disarm", |f| (f.asked.disarm, f.asked.any) = (true, true)),
    ("Land", |f| (f.asked.land, f.asked.any) = (true, true)),
    ("TakeOff", |f| (f.asked.take_off, f.asked.any) = (true, true)),
    ("Arm", |f| (f.asked.arm, f.asked.any) = (true, true)),
    ("WayPoint", |f| (f.asked.route, f.asked.any) = (true, true)),
    ("Flip", |f| (f.asked.flip, f.asked.any) = (true, true)),
    ("pilot's kill", |f| frame(f).kill = true),
    ("switch on", |f| f.pilot.switch.rises = true),
    ("switch off", |f| f.pilot.switch.falls = true),
    ("switch found off", |f| f.pilot.switch.found_off = true),
    ("mode switch to STABILIZE", |f| (f.pilot.mode_turned, f.pilot.mode) = (true, Some(FlightMode::Stabilize))),
    ("mode switch to ALT_HOLD", |f| (f.pilot.mode_turned, f.pilot.mode) = (true, Some(FlightMode::AltHold))),
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
    ("near the ground", |f| f.height = 0.05),
];

/// Alerts that differ in what they do. Every other one does the same as the first of its line: [`merged`], shown by
/// `alerts_of_a_kind_are_one`.
const KINDS: [&[Alerts]; 15] = [
    &[Alerts::COMM_LOST],
    // Motors off, and no arming.
    &[Alerts::IMPACT, Alerts::GYRO_ANOMALY, Alerts::TUMBLED, Alerts::IMU_LOST, Alerts::IMU_FAULTY, Alerts::MOTOR_LOST],
    // Landing at once, and no arming.
    &[Alerts::CRITICAL_BATTERY, Alerts::IMU_NOISY],
    // The same, and the estimator starts anew.
    &[Alerts::ESTIMATE_DIVERGED],
    // Landing at once.
    &[Alerts::MOTOR_WEAK, Alerts::STRUCK],
    // The same, motors off when it stands, and no arming.
    &[Alerts::FORCE_IMPLAUSIBLE, Alerts::ACCEL_FAULTY],
    // A take-off is over.
    &[Alerts::NO_LIFT],
    // A take-off is broken off, and no flip.
    &[Alerts::RANGE_IMPLAUSIBLE],
    // No flip, and no arming: always, and in a mode that holds height.
    &[Alerts::LOW_BATTERY, Alerts::POWER_LOST, Alerts::IMU_DEGRADED],
    &[Alerts::TOF_LOST],
    // No flip.
    &[Alerts::POWER_IMPLAUSIBLE, Alerts::FLOW_IMPLAUSIBLE],
    // No arming: always, in a mode that holds height, and in POS_HOLD.
    &[Alerts::USB_POWER, Alerts::TILT_MISMATCH, Alerts::SELF_TEST_FAILED, Alerts::MOTOR_RUNS],
    &[Alerts::BARO_LOST],
    &[Alerts::FLOW_LOST],
    // Told to people, and nothing else.
    &[Alerts::SELF_TEST_DIFFERS],
];

/// The set in which every alert stands for its kind.
fn merged(alerts: Alerts) -> Alerts {
    let kinds = KINDS.iter().filter(|kind| kind.iter().any(|alert| alerts.contains(*alert)));
    kinds.fold(Alerts::NONE, |merged, kind| merged | kind[0])
}

/// No alert, every kind alone, and every pair of kinds.
fn alert_sets() -> Vec<Alerts> {
    let mut sets = vec![Alerts::NONE];
    for (i, first) in KINDS.iter().enumerate() {
        sets.extend(KINDS[i..].iter().map(|second| first[0] | second[0]));
    }
    sets
}

/// What up to three happenings make of the facts, each result once: those in the order of the list, and the other orders of
/// the same where that makes a difference, as between two gestures of the one button.
fn happening_sets() -> Vec<Vec<Happening>> {
    // Nothing in here is what a happening writes, so two sets that differ anywhere differ here.
    let base =
        Facts { now: Instant::from_secs(100), valid: Validity::ALL, sticks: CommandSource::Guided, ..Facts::default() };
    let all = || HAPPENINGS.iter().copied();
    let mut sets = vec![vec![]];
    sets.extend(all().map(|one| vec![one]));
    sets.extend(all().flat_map(|a| all().map(move |b| vec![a, b])));
    sets.extend(all().flat_map(|a| all().flat_map(move |b| all().map(move |c| vec![a, b, c]))));
    let orders = sets.len();
    let mut seen = std::collections::BTreeMap::<_, Vec<Happening>>::new();
    for set in sets {
        let mut facts = base;
        set.iter().for_each(|(_, happen)| happen(&mut facts));
        seen.entry(std::format!("{facts:?}")).or_insert(set);
    }
    assert!(seen.len() > 1_500 && orders > 5 * seen.len(), "{} of {orders}", seen.len());
    seen.into_values().collect()
}

fn kills(facts: &Facts) -> bool {
    facts.asked.kill
        || facts.stop_button
        || facts.cut_off
        || facts.alerts.intersects(CUT)
        || facts.pilot.frame.is_some_and(|(_, input)| input.kill)
}

/// States that differ in all that decides: a disarmed vehicle has no commander and no silence, and how a landing or a
/// take-off begins matters to those alone.
fn states() -> Vec<State> {
    let mut states = vec![];
    for &phase in FlightPhase::ALL {
        let begins = matches!(phase, FlightPhase::Armed | FlightPhase::Landing);
        for wanted in [FlightMode::Stabilize, FlightMode::AltHold, FlightMode::PosHold] {
            for commander in [CommandSource::None, CommandSource::Pilot, CommandSource::Guided] {
                for landing_by_switch in [false, true] {
                    for silent_for in [None, Some(1), Some(3)] {
                        let idle = commander == CommandSource::None && silent_for.is_none();
                        if (!is_armed(phase) && !idle) || (!begins && landing_by_switch) {
                            continue;
                        }
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

/// The whole way to a motor: the real output stage, given more thrust than there is.
struct Motors {
    stage: MotorStage,
    now: Instant,
}

impl Motors {
    const FULL: Mixed = Mixed { thrust: [10.0; 8], count: 8, unmet: [0.0; 4] };

    fn new() -> Self {
        Self { stage: MotorStage::new(&MotorConfig::for_airframe(&Airframe::EXAMPLE)), now: Instant::ZERO }
    }

    /// Do any turn after a decision?
    fn turn(&mut self, armed: bool) -> bool {
        self.now += Duration::from_micros(2_500);
        self.stage.step(self.now, &Self::FULL, Some(7.4), armed).duty.iter().any(|duty| *duty > 0.0)
    }
}

#[test]
fn exhaustive_single_step() {
    let config = ModeConfig { flip_height: 1.0, ..ModeConfig::default() };
    let (sets, alert_sets, mut motors) = (happening_sets(), alert_sets(), Motors::new());
    let (mut seen, mut decisions, mut turned) = (BTreeSet::new(), 0u64, 0u64);
    for state in states() {
        for set in &sets {
            let mut facts = quiet(&state);
            set.iter().for_each(|(_, happen)| happen(&mut facts));
            for &alerts in &alert_sets {
                facts.alerts = alerts;
                let next_state = decide(&config, &state, &facts);
                decisions += 1;
                let why = || {
                    let names: Vec<_> = set.iter().map(|(name, _)| *name).collect();
                    std::format!("{state:?} with {alerts:?}, {names:?}")
                };
                if state.phase != next_state.phase {
                    seen.insert((state.phase as u32, next_state.phase as u32));
                }
                let turns = motors.turn(next_state.is_armed());
                turned += u64::from(turns);
                assert!(!turns || next_state.is_armed(), "motors of a disarmed vehicle: {}", why());
                assert!(!turns || !kills(&facts), "motors after a kill: {}", why());
                check(&state, &facts, &next_state, &why);
            }
        }
    }
    assert!(decisions > 10_000_000 && turned > decisions / 10, "{decisions}, with motors on {turned}");
    let held = |phase: FlightPhase| phase == FlightPhase::IdleHeld;
    let table = TABLE.iter().filter(|row| !held(row.from) && !held(row.to));
    let missed: Vec<_> = table.filter(|row| !seen.contains(&(row.from as u32, row.to as u32))).collect();
    assert!(missed.is_empty(), "never taken: {missed:?}");
}

/// What the exploration takes for granted: alerts of a kind are one, whatever others there are.
#[test]
fn alerts_of_a_kind_are_one() {
    let config = ModeConfig { flip_height: 1.0, ..ModeConfig::default() };
    let all: Vec<Alerts> = KINDS.iter().flat_map(|kind| kind.iter().copied()).collect();
    let union = all.iter().fold(Alerts::NONE, |union, alert| union | *alert);
    assert_eq!((union, all.len()), (Alerts::ALL, Alerts::NAMES.len()), "every alert has one kind");

    let mut sets = BTreeSet::new();
    for a in &all {
        for b in &all {
            sets.extend(all.iter().map(|c| (*a | *b | *c).bits()));
        }
    }
    // Larger ones: a stride that is odd comes to all of the 2^n sets in the end, and visits them evenly until then.
    sets.extend((0..3_000u32).map(|k| k.wrapping_mul(0x9e37_79b1) & Alerts::ALL.bits()));
    // What an alert refuses or changes.
    let relevant: [&[&str]; 7] = [
        &["Arm"],
        &["switch on", "mode switch to STABILIZE"],
        &["switch on", "mode switch to ALT_HOLD"],
        &["Flip"],
        &["TakeOff"],
        &["height lost"],
        &["near the ground"],
    ];
    let happens = |names: &[&str], facts: &mut Facts| {
        for name in names {
            HAPPENINGS.iter().find(|(known, _)| known == name).expect("a happening").1(facts);
        }
    };
    let of = |bits: &u32| {
        let each = Alerts::EACH.iter().filter(|alert| alert.bits() & bits != 0);
        each.fold(Alerts::NONE, |set, alert| set | *alert)
    };
    let sets: Vec<Alerts> = sets.iter().map(of).collect();
    for state in states() {
        for names in relevant {
            let mut facts = quiet(&state);
            happens(names, &mut facts);
            for alerts in sets.iter().copied() {
                let [as_is, as_merged] =
                    [alerts, merged(alerts)].map(|alerts| decide(&config, &state, &Facts { alerts, ..facts }));
                assert_eq!(as_is, as_merged, "{state:?} with {alerts:?} and {names:?}");
            }
        }
    }
    // And no two kinds are one.
    for (i, first) in KINDS.iter().enumerate() {
        for second in &KINDS[..i] {
            let differs = |state: &State| {
                relevant.iter().any(|names| {
                    let mut facts = quiet(state);
                    happens(names, &mut facts);
                    let next = |alerts| decide(&config, state, &Facts { alerts, ..facts });
                    next(first[0]) != next(second[0])
                })
            };
            assert!(states().iter().any(differs), "{:?} and {:?} are of one kind", first[0], second[0]);
        }
    }
}

fn check(state: &State, facts: &Facts, next_state: &State, why: &dyn Fn() -> std::string::String) {
    let (armed_before, armed) = (state.is_armed(), next_state.is_armed());
    if kills(facts) {
        assert!(!armed, "a kill lost: {}", why());
    }
    if armed && !armed_before {
        let asked = facts.asked.arm || facts.pilot.switch.rises || facts.button == Some(ButtonGesture::Click);
        assert!(asked && state.phase == FlightPhase::IdleGround, "armed unasked: {}", why());
        let ends = facts.asked.disarm || facts.asked.land || facts.pilot.switch.falls;
        assert!(!ends, "arming won: {}", why());
        assert!(facts.asked.any || !facts.alerts.contains(Alerts::COMM_LOST), "{}", why());
    }
    let legal = TABLE.iter().any(|row| row.from == state.phase && row.to == next_state.phase);
    assert!(legal || state.phase == next_state.phase, "not in the table: {}", why());
    if is_airborne(state.phase) {
        let stopped = !armed && !kills(facts) && !facts.landed;
        if stopped {
            let manual = state.mode.is_manual() && facts.pilot.switch.falls;
            let second = state.phase == FlightPhase::Landing && state.landing_by_switch && facts.pilot.switch.falls;
            let low = facts.known_height().is_some_and(|height| height < ModeConfig::default().stop_height);
            let stays = state.phase == FlightPhase::TakeOff && facts.alerts.contains(Alerts::NO_LIFT);
            let numb = facts.alerts.contains(Alerts::FORCE_IMPLAUSIBLE);
            let lands = state.phase == FlightPhase::Landing && (facts.asked.disarm || facts.pilot.switch.falls || numb);
            assert!(manual || second || low && (stays || lands), "motors stopped in the air: {}", why());
            assert!(low || !next_state.unacknowledged.is_empty(), "not to be acknowledged: {}", why());
        }
        let turned = facts.pilot.mode_turned || state.pending.is_some();
        if next_state.mode.is_manual() && !state.mode.is_manual() {
            assert!(turned, "the stick became thrust: {}", why());
        }
        let holds = next_state.phase == FlightPhase::Flying && next_state.mode.is_manual();
        assert!(!holds || facts.sticks == CommandSource::Pilot, "thrust of a stick that is not heard: {}", why());
        let broken_off = state.phase == FlightPhase::TakeOff && facts.alerts.contains(Alerts::RANGE_IMPLAUSIBLE);
        let ends = facts.asked.land || facts.asked.disarm || facts.pilot.switch.falls || facts.pilot.switch.found_off;
        if (ends || broken_off || facts.alerts.intersects(LAND)) && armed && state.phase != FlightPhase::Landing {
            assert_eq!(next_state.phase, FlightPhase::Landing, "{}", why());
        }
    }
    if state.phase == FlightPhase::Armed {
        assert!(!armed || !facts.alerts.intersects(LAND), "took off into a landing: {}", why());
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
    let config = ModeConfig { flip_height: 1.0, flip_room: 0.6, ceiling: 3.0, ..ModeConfig::default() };
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
        Facts { climbed: 2.5, ..asked },
        Facts { climbed: f32::NAN, ..asked },
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

/// Upside down the thrust of a landing would push it down.
#[test]
fn a_landing_waits_until_a_flip_has_ended_level() {
    let config = ModeConfig { flip_height: 1.0, ..ModeConfig::default() };
    let turning = State {
        phase: FlightPhase::Flip,
        wanted: FlightMode::PosHold,
        mode: FlightMode::PosHold,
        commander: CommandSource::Guided,
        inverted: true,
        entered: Instant::from_secs(100),
        ..State::default()
    };
    let later = |millis| Instant::from_secs(100) + Duration::from_millis(millis);
    let leans = Facts { now: later(500), upright: -0.5, at_rest: false, ..quiet(&turning) };
    let land = Asked { land: true, any: true, ..Asked::default() };
    for asked in [Facts { asked: land, ..leans }, Facts { alerts: Alerts::IMU_NOISY, ..leans }] {
        let waits = decide(&config, &turning, &asked);
        assert!(waits.phase == FlightPhase::Flip && waits.lands_next);
        let still = decide(&config, &waits, &Facts { now: later(600), ..leans });
        assert_eq!(still.phase, FlightPhase::Flip);
        let level = decide(&config, &still, &Facts { now: later(700), upright: 0.99, ..leans });
        assert_eq!(level.phase, FlightPhase::Landing, "though it falls");
        assert!(!decide(&config, &level, &Facts { now: later(710), ..leans }).lands_next);
        assert_eq!(decide(&config, &still, &Facts { now: later(5_000), ..leans }).phase, FlightPhase::Landing, "stuck");
    }
}

/// An accelerometer that lies feels no ground.
#[test]
fn a_landing_without_a_force_to_feel_the_ground_by_ends_where_the_vehicle_stands() {
    let landing = State { phase: FlightPhase::Landing, landing_limit: Duration::from_secs(30), ..State::default() };
    let next = |alerts: Alerts, height: f32, valid: Validity| {
        let facts = Facts { alerts, height, valid, now: Instant::ZERO, ..quiet(&landing) };
        decide(&ModeConfig::default(), &landing, &facts).phase
    };
    use FlightPhase::{IdleGround, Landing};
    assert_eq!(next(Alerts::FORCE_IMPLAUSIBLE, 0.07, Validity::ALL), IdleGround);
    assert_eq!(next(Alerts::FORCE_IMPLAUSIBLE, 0.09, Validity::ALL), Landing);
    assert_eq!(next(Alerts::MOTOR_WEAK, 0.07, Validity::ALL), Landing);
    assert_eq!(next(Alerts::FORCE_IMPLAUSIBLE, 0.07, Validity::TILT), Landing, "an unknown height");
}

#[test]
fn what_speaks_against_a_flip_is_named() {
    let config = ModeConfig { flip_height: 1.0, flip_room: 0.6, ceiling: 3.0, ..ModeConfig::default() };
    let flying = State {
        phase: FlightPhase::Flying,
        mode: FlightMode::PosHold,
        commander: CommandSource::Guided,
        ..State::default()
    };
    let good = Facts { height: 1.5, climbed: 1.5, ..quiet(&flying) };
    let blocks = |facts: Facts| flip_blocks(&config, &flying, &facts);
    assert_eq!(blocks(good), FlipBlocks::NONE);
    for (facts, expected) in [
        (Facts { height: 0.9, ..good }, FlipBlocks::LOW),
        (Facts { climbed: 2.5, ..good }, FlipBlocks::NO_ROOM),
        (Facts { valid: Validity::ALL.without(Validity::VELOCITY_Z), ..good }, FlipBlocks::ESTIMATE),
        (Facts { upright: 0.9, ..good }, FlipBlocks::UNSTEADY),
        (Facts { alerts: Alerts::FLOW_IMPLAUSIBLE, ..good }, FlipBlocks::ALERT),
    ] {
        assert_eq!(blocks(facts), expected);
    }
    let piloted = State { commander: CommandSource::Pilot, ..flying };
    assert_eq!(flip_blocks(&config, &piloted, &good), FlipBlocks::NOT_LED);
    let lands = State { phase: FlightPhase::Landing, ..flying };
    assert_eq!(flip_blocks(&config, &lands, &good), FlipBlocks::NOT_FLYING);
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

/// `happens` is total: it is not asked where the table has no row, and would say no.
#[test]
fn on_the_ground_nothing_stops() {
    for phase in [FlightPhase::Init, FlightPhase::IdleGround, FlightPhase::IdleHeld, FlightPhase::Flip] {
        let state = State { phase, ..State::default() };
        let mut facts = Facts::default();
        HAPPENINGS.iter().for_each(|(_, happen)| happen(&mut facts));
        assert!(!happens(Event::Stop, &ModeConfig::default(), true, &state, &facts), "{phase:?}");
    }
}

/// A flight by a program, a step every 20 ms.
struct Flown {
    state: State,
    facts: Facts,
}

impl Flown {
    fn new(phase: FlightPhase) -> Self {
        let wanted = FlightMode::PosHold;
        let commander = if is_armed(phase) { CommandSource::Guided } else { CommandSource::None };
        let state = State { phase, wanted, mode: wanted, commander, ..State::default() };
        Self { state, facts: quiet(&state) }
    }

    /// For so long with these alerts.
    fn pass(&mut self, millis: u64, alerts: Alerts) -> &State {
        self.facts.alerts = alerts;
        for _ in 0..millis / 20 {
            self.facts.now += Duration::from_millis(20);
            self.state = decide(&ModeConfig::default(), &self.state, &self.facts);
        }
        &self.state
    }
}

#[test]
fn a_lost_estimate_is_started_anew_once() {
    let mut flown = Flown::new(FlightPhase::IdleGround);
    for (alerts, resets) in
        [(Alerts::ESTIMATE_DIVERGED, 1), (Alerts::NONE, 1), (Alerts::ESTIMATE_DIVERGED, 2), (Alerts::NONE, 2)]
    {
        assert_eq!(flown.pass(20, alerts).full_resets, resets);
        assert_eq!(flown.pass(200, alerts).full_resets, resets);
    }
}

/// A command that arms is heard before the failsafe says so.
#[test]
fn silence_before_arming_is_none() {
    let mut flown = Flown::new(FlightPhase::IdleGround);
    flown.pass(10_000, Alerts::COMM_LOST);
    flown.facts.asked = Asked { arm: true, any: true, ..Asked::default() };
    assert_eq!(flown.pass(20, Alerts::COMM_LOST).phase, FlightPhase::Armed);
    flown.facts.asked = Asked::default();
    assert_eq!(flown.pass(100, Alerts::COMM_LOST).phase, FlightPhase::Armed);
}

#[test]
fn a_silence_is_over_when_the_link_has_been_heard_for_a_second_and_began_two_seconds_ago() {
    let over_after = |silent: u64| {
        let mut flown = Flown::new(FlightPhase::Flying);
        assert!(flown.pass(silent, Alerts::COMM_LOST).silence.is_some());
        (1..400).find(|_| flown.pass(20, Alerts::NONE).silence.is_none()).map(|steps| silent + 20 * steps)
    };
    // The first step of silence, or of sound, has lasted for nothing.
    assert_eq!(over_after(100), Some(2_020));
    assert_eq!(over_after(2_000), Some(3_020));
    let mut flown = Flown::new(FlightPhase::Flying);
    let lands = (0..10).find(|_| {
        flown.pass(100, Alerts::COMM_LOST);
        flown.pass(900, Alerts::NONE).phase == FlightPhase::Landing
    });
    assert_eq!(lands, Some(3), "a link that flaps is none");
}

#[test]
fn a_lifted_vehicle_that_knows_its_height_stays_lifted() {
    let mut flown = Flown::new(FlightPhase::IdleHeld);
    let State { phase, transitions, .. } = *flown.pass(10_000, Alerts::NONE);
    assert_eq!((phase, transitions), (FlightPhase::IdleHeld, 0));
}

/// Does an event happen to a vehicle with nothing the matter, a tenth of a second after its phase began, when this is changed?
fn happens_with(event: Event, phase: FlightPhase, mode: FlightMode, change: fn(&mut State, &mut Facts)) -> bool {
    let config = ModeConfig::default();
    let Flown { mut state, mut facts } = Flown::new(phase);
    (state.wanted, state.mode, state.landing_limit) = (mode, mode, Duration::from_secs(60));
    state.entered = Instant::from_secs(100);
    facts.now = Instant::from_millis(100_100);
    change(&mut state, &mut facts);
    happens(event, &config, mode.is_manual(), &state, &facts)
}

/// Since so many milliseconds before the step of [`happens_with`].
fn ago(millis: u64) -> Option<Instant> {
    Some(Instant::from_millis(100_100 - millis))
}

#[test]
fn every_event_happens_for_each_of_its_reasons_and_for_nothing_less() {
    use FlightMode::{PosHold, Stabilize};
    use FlightPhase::{Armed, Flying, IdleGround, IdleHeld, Init, Landing, TakeOff};
    type Change = fn(&mut State, &mut Facts);
    let table: &[(Event, FlightPhase, FlightMode, &[Change], &[Change])] = &[
        (
            Event::Emergency,
            Flying,
            PosHold,
            &[
                |_, f| f.asked.kill = true,
                |_, f| f.stop_button = true,
                |_, f| f.cut_off = true,
                |_, f| frame(f).kill = true,
                |_, f| f.alerts = Alerts::MOTOR_LOST,
            ],
            &[|_, f| f.alerts = Alerts::MOTOR_WEAK, |_, f| f.button = Some(ButtonGesture::Press)],
        ),
        (
            Event::Stop,
            Armed,
            PosHold,
            &[
                |_, f| f.asked.disarm = true,
                |_, f| f.pilot.switch.falls = true,
                |_, f| f.pilot.switch.found_off = true,
                |s, f| s.entered = f.now - Duration::from_secs(10),
            ],
            &[|_, _| (), |s, f| s.entered = f.now - Duration::from_millis(9_990)],
        ),
        (
            Event::Stop,
            Flying,
            Stabilize,
            &[|_, f| f.pilot.switch.falls = true],
            &[
                |_, _| (),
                |_, f| f.asked.disarm = true,
                |_, f| f.pilot.switch.found_off = true,
                |s, f| (s.mode, f.pilot.switch.falls) = (PosHold, true),
            ],
        ),
        (
            Event::Stop,
            Flying,
            PosHold,
            &[],
            &[|_, f| f.pilot.switch.falls = true, |s, f| (s.mode, f.pilot.switch.falls) = (Stabilize, true)],
        ),
        (
            Event::Stop,
            Landing,
            PosHold,
            &[
                |_, f| (f.height, f.asked.disarm) = (0.14, true),
                |_, f| (f.height, f.pilot.switch.falls) = (0.14, true),
                |_, f| (f.contact, f.asked.disarm) = (GroundContact::Ground, true),
                |s, f| (s.landing_by_switch, f.pilot.switch.falls) = (true, true),
                |s, f| s.entered = f.now - s.landing_limit,
            ],
            &[
                |_, f| f.asked.disarm = true,
                |_, f| f.pilot.switch.falls = true,
                |s, f| (s.landing_by_switch, f.height) = (true, 0.14),
                |s, f| (s.landing_by_switch, f.asked.disarm) = (true, true),
                |_, f| (f.valid, f.height, f.asked.disarm) = (Validity::TILT, 0.14, true),
            ],
        ),
        (
            Event::Land,
            Flying,
            PosHold,
            &[
                |_, f| f.asked.land = true,
                |_, f| f.asked.disarm = true,
                |_, f| f.pilot.switch.falls = true,
                |_, f| f.pilot.switch.found_off = true,
                |s, f| {
                    s.silence = ago(3_000).map(|since| Silence { since, heard_since: None });
                    f.alerts = Alerts::COMM_LOST;
                },
                |s, _| s.blind = ago(1_000),
                |s, f| (s.blind, f.alerts) = (ago(0), Alerts::COMM_LOST),
                |s, f| (s.blind, f.sticks) = (ago(0), CommandSource::Failsafe),
                |s, _| s.adrift = ago(1_000),
                |_, f| f.alerts = Alerts::MOTOR_WEAK,
            ],
            &[
                |s, _| s.silence = ago(9_000).map(|since| Silence { since, heard_since: None }),
                |_, f| f.alerts = Alerts::COMM_LOST,
                |_, f| f.sticks = CommandSource::Failsafe,
                |s, _| (s.blind, s.adrift) = (ago(990), ago(990)),
                |s, f| (s.entered, f.alerts) = (Instant::ZERO, Alerts::RANGE_IMPLAUSIBLE),
            ],
        ),
        (
            Event::Land,
            TakeOff,
            PosHold,
            &[|_, f| f.alerts = Alerts::RANGE_IMPLAUSIBLE, |s, f| s.entered = f.now - Duration::from_secs(15)],
            &[|s, f| s.entered = f.now - Duration::from_millis(14_990)],
        ),
        (Event::TakeOffComplete, TakeOff, PosHold, &[|_, f| f.takeoff_complete = true], &[|_, _| ()]),
        (Event::TakeOffComplete, TakeOff, Stabilize, &[|_, _| ()], &[|_, f| f.contact = GroundContact::Ground]),
        (
            Event::TakeOff,
            Armed,
            PosHold,
            &[
                |_, f| f.asked.take_off = true,
                |s, f| (s.takes_off, s.entered) = (true, f.now - Duration::from_millis(300)),
            ],
            &[|s, _| s.takes_off = true, |s, _| s.entered = Instant::ZERO],
        ),
        (
            Event::TakeOff,
            Armed,
            Stabilize,
            &[|s, f| {
                (s.commander, f.sticks, s.throttle_rested, frame(f).throttle) =
                    (CommandSource::Pilot, CommandSource::Pilot, true, 0.11)
            }],
            &[
                |s, f| (s.takes_off, s.entered, f.sticks) = (true, Instant::ZERO, CommandSource::Pilot),
                |s, f| {
                    (s.commander, f.sticks, s.throttle_rested, frame(f).throttle) =
                        (CommandSource::Pilot, CommandSource::Pilot, true, 0.09)
                },
                |s, f| (s.commander, f.sticks, frame(f).throttle) = (CommandSource::Pilot, CommandSource::Pilot, 1.0),
                |s, f| (f.sticks, s.throttle_rested, frame(f).throttle) = (CommandSource::Pilot, true, 1.0),
                |s, f| (s.commander, s.throttle_rested, frame(f).throttle) = (CommandSource::Pilot, true, 1.0),
            ],
        ),
        (
            Event::SetDown,
            IdleHeld,
            PosHold,
            &[|_, f| f.height = 0.07, |s, f| (s.unmeasured, f.valid) = (ago(2_000), Validity::TILT)],
            &[|_, f| f.height = 0.09, |s, f| (s.unmeasured, f.valid, f.height) = (ago(1_990), Validity::TILT, 0.0)],
        ),
        (
            Event::Lifted,
            IdleGround,
            PosHold,
            &[|_, f| f.height = 0.16],
            &[|_, f| f.height = 0.14, |_, f| (f.valid, f.height) = (Validity::TILT, 9.0)],
        ),
        (
            Event::Ready,
            Init,
            PosHold,
            &[|_, f| f.valid = Validity::TILT],
            &[|_, f| f.calibrated = false, |_, f| f.valid = Validity::NONE],
        ),
    ];
    for (event, phase, mode, reasons, others) in table {
        for (changes, expected) in [(reasons, true), (others, false)] {
            for (place, change) in changes.iter().enumerate() {
                let found = happens_with(*event, *phase, *mode, *change);
                assert_eq!(found, expected, "{event:?} in {phase:?}, {mode:?}: change {place} of those {expected}");
            }
        }
    }
}
