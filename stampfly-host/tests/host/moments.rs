//! The moments at which faults begin: each comes in the flights that are said to have it and in no
//! others, those flights end well without a fault, and one that never comes is said aloud.

use crate::thorough::thorough;
use serde_json::Value;
use stampfly_board::simulation::mission::{Mission, OCCASIONS, SHORT};
use stampfly_board::simulation::{Outcome, Setup, StampFly};
use stampfly_host::campaign::case::Case;
use stampfly_host::campaign::flight::fly_case;
use stampfly_host::campaign::row::IDLE;
use stampfly_host::flown::fly;
use stampfly_sim::fault::{Fault, Moment};
use stampfly_sim::vehicle::{Options, Vehicle, Verdict};
use stampfly_types::messages::FlightMode;
use std::process::Command;

const PILOTS: [Option<FlightMode>; 5] =
    [None, Some(FlightMode::PosHold), Some(FlightMode::AltHold), Some(FlightMode::Stabilize), Some(FlightMode::Acro)];

fn flown(mission: &str, pilot: Option<FlightMode>, seed: u64, faults: &[String]) -> Outcome {
    let mission = Mission::parse(mission).expect("a mission");
    let faults = faults.iter().map(|text| Fault::parse(text, StampFly::FAULTS).expect("a fault")).collect();
    let setup = Setup { mission, faults, pilot, ..Setup::reference(seed) };
    fly::<StampFly>(&setup, &mut (), &mut |_, _| {}).outcome
}

/// A fault at each moment that changes nothing that matters.
fn at_every_moment() -> Vec<String> {
    Moment::ALL.iter().map(|moment| format!("mag-bent=3@{}+0.1", moment.name())).collect()
}

#[test]
fn each_moment_comes_where_it_is_said_to_come_and_nowhere_else() {
    for mission in [SHORT].iter().chain(OCCASIONS) {
        for pilot in PILOTS {
            let expected = Mission::parse(mission).expect("a mission").moments(pilot);
            let outcome = flown(mission, pilot, 1, &at_every_moment());
            let begun = Moment::ALL.iter().zip(&outcome.judgement.faults).filter(|(_, span)| span.since.is_some());
            // What turns over drifts as fast as what flies to a place.
            let drifts = |moment: &Moment| [Moment::Hover, Moment::Move].contains(moment) && !expected.contains(moment);
            let begun: Vec<Moment> = begun.map(|(moment, _)| *moment).filter(|moment| !drifts(moment)).collect();
            assert_eq!(begun, expected, "{mission} {pilot:?}: {}", outcome.judgement.reason);
        }
    }
}

/// The mission's own steps are no failure: a fault that is to change nothing must not look as if it
/// did.
#[test]
fn flights_with_these_moments_end_well_without_a_fault() {
    for mission in OCCASIONS {
        for pilot in PILOTS {
            for seed in 1..=thorough(1, 10) {
                let outcome = flown(mission, pilot, seed, &[]);
                let judgement = &outcome.judgement;
                let what = format!("{mission} {pilot:?} seed {seed}: {}", judgement.reason);
                assert!(outcome.succeeded() && judgement.outcome == "transparent", "{what}");
                assert_eq!(judgement.cut_in_air, None, "{what}");
            }
        }
    }
}

#[test]
fn a_fault_that_may_change_nothing_may_change_nothing_at_these_moments_either() {
    for (mission, moment, pilot) in [
        (OCCASIONS[0], "flip", None),
        (OCCASIONS[0], "flip", Some(FlightMode::AltHold)),
        (OCCASIONS[1], "mode", Some(FlightMode::Stabilize)),
        (OCCASIONS[2], "mode", Some(FlightMode::PosHold)),
        (OCCASIONS[3], "chop", Some(FlightMode::Acro)),
        (OCCASIONS[4], "parameter", None),
        (SHORT, "calibration", None),
    ] {
        let outcome = flown(mission, pilot, 2, &[format!("baro-stuck@{moment}")]);
        let judgement = &outcome.judgement;
        assert!(outcome.succeeded(), "{moment} {pilot:?}: {} {:?}", judgement.reason, judgement.violations);
    }
}

/// A gyro that is off while the vehicle calibrates, and right afterwards, is off the other way in
/// flight.
#[test]
fn a_fault_while_it_calibrates_is_one_of_the_calibration() {
    let still = flown(SHORT, None, 1, &["gyro-bias=0.02@calibration+60".into()]);
    assert!(still.judgement.outcome != "refused" && still.judgement.as_expected, "{:?}", still.judgement);
    let shaken = flown(SHORT, None, 1, &["gyro-spikes=5@calibration+60".into()]);
    assert_eq!(shaken.judgement.outcome, "refused", "a sensor that is not still: {}", shaken.judgement.reason);
}

#[test]
fn a_moment_that_never_comes_is_said_aloud() {
    let options = Options {
        mission: Some(SHORT.into()),
        fault: vec!["tof-silent@flip".into(), "baro-step@hover".into()],
        ..Options::default()
    };
    let case = Case { vehicle: "stampfly".into(), index: 0, seed: 1, options };
    let row = fly_case::<StampFly>(&case).expect("a flight");
    assert_eq!((row.verdict.as_str(), row.never_began.as_deref()), (IDLE, Some("flip")));

    let folder = crate::program::folder("moments", "never");
    let run = |words: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_stampfly")).current_dir(&folder).args(words).output();
        String::from_utf8(output.expect("the program starts").stdout).expect("text")
    };
    let fault = ["--mission", SHORT, "--fault", "tof-silent@chop"];
    let said = run(&[&["fly"], &fault[..]].concat());
    assert!(said.contains("fault tof-silent@chop never began") && said.contains("VIOLATED I12"), "{said}");
    // With a mission that has none of them, no flight of a campaign waits for one.
    let line =
        ["campaign", "--faults", "--only", "mag-bent=3", "--flights", "9", "--mission", "arm; takeoff 0.3; land"];
    let said: Value = serde_json::from_str(&run(&[&line[..], &["--json"]].concat())).expect("JSON");
    assert_eq!(said["never_began"], serde_json::json!({}), "{said}");
}
