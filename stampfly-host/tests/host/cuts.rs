//! Motors that a protection stops in the air: the same flight, flown on, says whether it was right
//! to.

use stampfly_board::simulation::StampFly;
use stampfly_host::campaign::case::Case;
use stampfly_host::campaign::flight::fly_case;
use stampfly_host::campaign::row::{NEEDLESS_CUT, PASSED, Row};
use stampfly_host::flown::fly;
use stampfly_host::recorder::Recorder;
use stampfly_sim::vehicle::{Options, Vehicle, Verdict};
use std::process::Command;

const MISSION: &str = "arm; takeoff 0.8; hover 3; land";
/// A gyro that is off for 20 ms, of which a sound limit of the rate says nothing.
const BURST: &str = "gyro-bias=6@hover+0.02";
/// A limit of the rate that a pilot's stick passes: absurdly low.
const ABSURD: &[&str] = &["failsafe.rate.max=5"];
const ALERT: &str = "GYRO_ANOMALY";

fn options(fault: &str, param: &[&str]) -> Options {
    Options {
        mission: Some(MISSION.into()),
        fault: vec![fault.into()],
        param: param.iter().map(|text| (*text).to_owned()).collect(),
        ..Options::default()
    }
}

fn row(options: Options) -> Row {
    fly_case::<StampFly>(&Case { vehicle: "stampfly".into(), index: 0, seed: 3, options }).expect("a flight")
}

/// A motor that turns at full duty turns the vehicle over, whether the others stop or not.
#[test]
fn a_cut_of_a_vehicle_that_would_have_crashed_was_right() {
    let row = row(options("motor-3-stuck@hover", &[]));
    assert!(row.cut_by.is_some(), "{row:?}");
    assert_eq!((row.flown_on.as_deref(), row.cut_was_needless()), (Some("crashed"), Some(false)), "{row:?}");
    assert_eq!(row.verdict, PASSED);
}

#[test]
fn a_cut_of_a_vehicle_that_would_have_flown_on_was_needless() {
    let sound = row(options(BURST, &[]));
    assert_eq!((sound.cut_by, sound.flown_on, sound.verdict.as_str()), (None, None, PASSED));
    let row = row(options(BURST, ABSURD));
    assert_eq!(row.outcome, "cut", "{row:?}");
    assert!(row.flown_on.is_some() && row.cut_was_needless() == Some(true), "{row:?}");
    assert_eq!(row.verdict, NEEDLESS_CUT, "{row:?}");
    assert!(row.failed() && row.as_expected, "the end is one that the fault allows, and still wrong");
}

/// The protection's verdict is there in both flights, and they are the same until it comes.
#[test]
fn a_flight_that_flies_on_has_the_alert_and_replays() {
    let options = Options { flies_on: true, ..options(BURST, ABSURD) };
    let setup = StampFly::setup(&options, 3).expect("options");
    let facts = stampfly_host::log::refly::facts::<StampFly>(&options, 3).expect("options");
    let mut recorder = Recorder::<StampFly>::with_log(&setup, &facts);
    let outcome = fly::<StampFly>(&setup, &mut recorder, &mut |_, _| {}).outcome;
    let judgement = &outcome.judgement;
    assert!(judgement.alerts.iter().any(|span| span.name == ALERT), "{judgement:?}");
    assert_eq!((judgement.cut_in_air.as_deref(), outcome.metrics.landed), (None, true), "{judgement:?}");
    let replayed = crate::replay::replay(recorder.log()).expect("a log");
    assert_eq!(replayed.difference, None);

    let first = Options { flies_on: false, ..options };
    let cut = fly::<StampFly>(&StampFly::setup(&first, 3).expect("options"), &mut (), &mut |_, _| {}).outcome;
    let since = |outcome: &stampfly_board::simulation::Outcome| {
        outcome.judgement.alerts.iter().find(|span| span.name == ALERT).map(|span| span.since)
    };
    assert_eq!((cut.judgement.cut_in_air.as_deref(), since(&cut)), (Some(ALERT), since(&outcome)));
    assert_eq!(cut.judgement.outcome, "cut", "{:?}", cut.judgement);
}

/// The mask is an option of a simulated flight, and not a parameter of a vehicle.
#[test]
fn nothing_but_the_simulators_option_masks_a_protection() {
    let refused = |words: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_stampfly")).args(words).output().expect("the program starts");
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (code, said) = refused(&["fly", "--param", "simulation.flies_on=1"]);
    assert!(code == Some(2) && said.contains("there is no such parameter"), "{said}");
    let (code, said) = refused(&["hil", "--emulated", "--fly-on"]);
    assert!(code == Some(2) && said.contains("--fly-on"), "{said}");
    for vehicle in ["rover", "plane", "stm32-quad"] {
        let (code, said) = refused(&["fly", "--vehicle", vehicle, "--fly-on"]);
        assert!(code == Some(2) && said.contains("--fly-on"), "{vehicle}: {said}");
    }
    let settings = StampFly::parameters(&StampFly::default_config());
    assert!(settings.iter().all(|setting| !setting.name.starts_with("simulation.")));
    assert!(stampfly_board::parameters::all().all(|info| !info.name.contains("flies_on")));
}

#[test]
fn a_flight_that_crashes_when_it_flies_on_is_over_then() {
    let options = Options { flies_on: true, ..options("motor-3-stuck@hover", &[]) };
    let setup = StampFly::setup(&options, 3).expect("options");
    let flown = fly::<StampFly>(&setup, &mut (), &mut |_, _| {});
    assert_eq!(flown.outcome.judgement.outcome, "crashed", "{}", flown.outcome.judgement.reason);
    assert!(!flown.outcome.succeeded() && flown.duration.seconds() < 15.0, "{}", flown.duration);
}
