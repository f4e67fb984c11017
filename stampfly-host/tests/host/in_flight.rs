//! Faults in flight: every one of the table does something, begins when it should, and repeats; a pilot flies every mode.

use stampfly_board::simulation::mission::Mission;
use stampfly_board::simulation::sensing::Sensing;
use stampfly_board::simulation::{Outcome, Setup, StampFly};
use stampfly_host::flown::fly;
use stampfly_host::recorder::Recorder;
use stampfly_sim::fault::{Fault, FaultKind, Moment};
use stampfly_sim::vehicle::{Vehicle, Verdict};
use stampfly_types::Duration;
use stampfly_types::messages::{FlightMode, FlightPhase};

const FAULTS: &[FaultKind] = StampFly::FAULTS;

fn setup(mission: &str, faults: &[&str]) -> Setup {
    let mission = Mission::parse(mission).expect("a mission");
    let faults = faults.iter().map(|text| Fault::parse(text, FAULTS).expect("a fault")).collect();
    Setup { mission, faults, ..Setup::reference(1) }
}

fn flown(setup: &Setup) -> (Outcome, u64) {
    let mut recorder = Recorder::<StampFly>::hash_only();
    let outcome = fly::<StampFly>(setup, &mut recorder, &mut |_, _| {}).outcome;
    (outcome, recorder.hash())
}

/// Flies until it is on its way to another place.
fn hop(fault: &str) -> Setup {
    Setup { limit: Duration::from_secs(8), ..setup("arm\ntakeoff 0.5\ngoto 1 0 0.5\nland\n", &[fault]) }
}

#[test]
fn every_fault_changes_something_and_what_the_vehicle_publishes() {
    let pilot = Some(FlightMode::PosHold);
    let healthy = hop("baro-step=0@takeoff");
    let healthy = [&healthy, &Setup { pilot, ..healthy.clone() }].map(|setup| flown(setup).1);
    for kind in FAULTS {
        let mut setup = hop(&format!("{}@takeoff", kind.name));
        let by_pilot = kind.name.starts_with("pilot");
        setup.pilot = pilot.filter(|_| by_pilot);
        let (outcome, hash) = flown(&setup);
        let span = &outcome.judgement.faults[0];
        assert!(span.since.is_some() && span.changes > 0, "{span:?}");
        assert!(!outcome.judgement.violations.contains(&"I12"), "{}", kind.name);
        assert_ne!(hash, healthy[usize::from(by_pilot)], "{} is not seen", kind.name);
    }
}

#[test]
fn a_fault_that_changes_nothing_is_found() {
    for fault in ["baro-step=0@takeoff", "baro-step@7.5", "pilot-nan@takeoff", "baro-step@touch"] {
        let (outcome, _) = flown(&hop(fault));
        let vacuous = fault != "baro-step@7.5";
        assert_eq!(outcome.judgement.violations.contains(&"I12"), vacuous, "{fault}");
        assert!(!vacuous || !outcome.succeeded(), "{fault}");
    }
}

#[test]
fn the_usual_moments_come_in_their_order() {
    let faults: Vec<_> = Moment::USUAL.iter().map(|moment| format!("mag-bent=5@{}+0.1", moment.name())).collect();
    let faults: Vec<_> = faults.iter().map(String::as_str).collect();
    let mission = "arm\ntakeoff 0.4\nhover 2\ngoto 0.8 0 0.4\nland\n";
    for pilot in [None, Some(FlightMode::PosHold), Some(FlightMode::Stabilize)] {
        let (outcome, _) = flown(&Setup { pilot, ..setup(mission, &faults) });
        let begun: Vec<_> = outcome.judgement.faults.iter().map(|span| span.since.expect("it begins")).collect();
        assert!(begun.is_sorted_by(|a, b| a < b), "{pilot:?}: {begun:?}");
        assert!(begun[1] - begun[0] >= 2.0, "there is time to notice before arming: {begun:?}");
    }
}

#[test]
fn a_flight_with_faults_repeats_bit_for_bit() {
    for fault in ["gyro-spikes@takeoff", "tof-outliers@spool+1", "stall=30@takeoff", "motor-2-thrust=0.7@takeoff"] {
        let [first, again] = [(); 2].map(|()| flown(&hop(fault)));
        assert_eq!((first.1, &first.0.judgement), (again.1, &again.0.judgement), "{fault}");
    }
}

#[test]
fn a_fault_that_ends_leaves_no_trace_behind() {
    let (outcome, _) = flown(&setup("arm\ntakeoff 0.4\nhover 2\nland\n", &["power-silent@hover+0.15"]));
    let judgement = &outcome.judgement;
    assert!(outcome.succeeded() && judgement.violations.is_empty(), "{judgement:?}");
}

#[test]
fn silence_of_the_inertial_sensor_cuts_the_motors() {
    let (outcome, _) = flown(&hop("imu-silent@takeoff"));
    let judgement = &outcome.judgement;
    assert_eq!((judgement.outcome, judgement.as_expected), ("cut", true), "{judgement:?}");
    assert!(judgement.cut_after_s.is_some_and(|after| (0.05..0.0575).contains(&after)), "{judgement:?}");
    assert!(judgement.cut_height_m.is_some_and(|height| height > 0.1), "{judgement:?}");
    assert!(judgement.alerts.iter().any(|alert| alert.name == "IMU_LOST"), "{judgement:?}");
}

#[test]
fn a_flight_band_that_stalls_is_cut_off_from_outside() {
    let (outcome, _) = flown(&hop("stall=200@takeoff"));
    let judgement = &outcome.judgement;
    assert_eq!(judgement.outcome, "cut");
    assert!(judgement.cut_after_s.is_some_and(|after| (0.06..0.0675).contains(&after)), "{judgement:?}");
}

#[test]
fn a_dead_bus_is_one_behind_drivers_and_emulated_chips_too() {
    for fault in ["spi-dead@takeoff", "i2c-dead@takeoff"] {
        let (outcome, _) = flown(&Setup { sensing: Sensing::Chips, ..hop(fault) });
        assert!(outcome.judgement.faults[0].changes > 0, "{:?}", outcome.judgement);
    }
    let (outcome, _) = flown(&Setup { sensing: Sensing::Chips, ..hop("spi-dead@takeoff") });
    assert_eq!(outcome.judgement.outcome, "cut");
}

#[test]
fn a_pilot_flies_a_mission_in_every_mode() {
    let mission = "arm\ntakeoff 0.5\nhover 2\ngoto 0.8 0 0.6\nland\n";
    for mode in [FlightMode::PosHold, FlightMode::AltHold, FlightMode::Stabilize, FlightMode::Acro] {
        let (outcome, _) = flown(&Setup { pilot: Some(mode), ..setup(mission, &[]) });
        let judgement = &outcome.judgement;
        assert!(outcome.succeeded() && judgement.violations.is_empty(), "{mode:?}: {judgement:?}");
        assert!(judgement.max_height_m > 0.5 && judgement.max_distance_m < 1.5, "{mode:?}: {judgement:?}");
        assert!(judgement.touch_speed_mps.is_some_and(|speed| speed < 0.6), "{mode:?}: {judgement:?}");
        let flown_in = |change: &stampfly_board::simulation::PhaseChange| change.mode == mode;
        assert!(outcome.phases.iter().any(flown_in), "{mode:?}: {:?}", outcome.phases);
    }
}

const MODES: [FlightMode; 4] = [FlightMode::Stabilize, FlightMode::Acro, FlightMode::AltHold, FlightMode::PosHold];

/// A short flight with a pilot.
fn piloted(mode: FlightMode, seed: u64, faults: &[&str]) -> Outcome {
    let common = setup("arm\ntakeoff 0.5\nhover 2\ngoto 1 0 0.5\nland\n", faults);
    let reference = Setup::reference(seed);
    flown(&Setup { mission: common.mission, faults: common.faults, pilot: Some(mode), ..reference }).0
}

/// Nobody announces a landing in STABILIZE and ACRO, and no manoeuvre or gust is a weak motor.
#[test]
fn nothing_is_found_in_a_flight_by_hand() {
    for mode in MODES {
        for seed in 1..=4 {
            let outcome = piloted(mode, seed, &[]);
            let alerts: Vec<_> = outcome.judgement.alerts.iter().map(|span| span.name).collect();
            assert_eq!(alerts, ["COMM_LOST"], "{mode:?}, seed {seed}: before the first frame, and no other");
            assert!(outcome.finished, "{mode:?}, seed {seed}");
        }
    }
}

#[test]
fn half_a_propeller_in_the_air_ends_in_a_landing() {
    for mode in MODES {
        for motor in 1..=4 {
            let outcome = piloted(mode, 1, &[&format!("motor-{motor}-thrust@hover")]);
            let judgement = &outcome.judgement;
            assert!(judgement.alerts.iter().any(|span| span.name == "MOTOR_WEAK"), "{mode:?} {motor}");
            assert_eq!(judgement.outcome, "landed", "{mode:?} {motor}: {judgement:?}");
        }
    }
}

/// They counted as centred, which in STABILIZE and ACRO is half throttle.
#[test]
fn sticks_that_are_no_numbers_end_in_a_landing() {
    for mode in MODES {
        let judgement = piloted(mode, 1, &["pilot-nan@hover"]).judgement;
        assert_eq!(judgement.outcome, "landed", "{mode:?}: {judgement:?}");
        assert!(judgement.touch_speed_mps.is_some_and(|speed| speed < 0.5), "{mode:?}: {judgement:?}");
    }
}

#[test]
fn a_ceiling_over_the_take_off_ends_it() {
    let outcome = flown(&setup("arm\ntakeoff 0.5\nhover 2\nland\n", &["ceiling@spool"])).0;
    assert_eq!(outcome.judgement.outcome, "landed", "{:?}", outcome.judgement);
}

/// It pushed the vehicle up to 1.7 m, or by a quarter of a metre with every turn of the phase.
#[test]
fn a_range_that_lies_from_the_take_off_on_does_not_carry_the_vehicle_away() {
    for fault in ["tof-stuck@ground", "tof-stuck@takeoff", "tof-alias@ground", "tof-alias@hover", "tof-outliers@spool"]
    {
        let judgement = flown(&setup("arm\ntakeoff 0.5\nhover 2\ngoto 1 0 0.7\nland\n", &[fault])).0.judgement;
        // Outliers at the distance where it stood are those of a smeared window, and left out.
        let is_found = judgement.alerts.iter().any(|span| span.name == "RANGE_IMPLAUSIBLE");
        assert!(is_found || fault.starts_with("tof-outliers"), "{fault}");
        assert!(judgement.as_expected && judgement.max_above_m < 0.8, "{fault}: {judgement:?}");
    }
}

/// The motors stopped in the air, 1.8 s after the first spike.
#[test]
fn spikes_of_the_gyro_end_in_a_landing() {
    for mode in [FlightMode::AltHold, FlightMode::PosHold] {
        let judgement = piloted(mode, 2, &["gyro-spikes@hover"]).judgement;
        assert!(judgement.alerts.iter().any(|span| span.name == "IMU_NOISY"), "{mode:?}");
        assert_eq!(judgement.outcome, "landed", "{mode:?}: {judgement:?}");
    }
}

/// It tipped over, and lay on its back. What cannot be trimmed lands.
#[test]
fn half_a_propeller_on_the_ground_ends_upright() {
    for motor in 1..=4 {
        let fault = format!("motor-{motor}-thrust@spool");
        let judgement = flown(&setup("arm\ntakeoff 0.5\nhover 2\nland\n", &[&fault])).0.judgement;
        assert!(judgement.as_expected && judgement.max_height_m < 0.5, "{fault}: {judgement:?}");
        let turned = |name: &str| judgement.alerts.iter().any(|span| span.name == name);
        assert!(!["GYRO_ANOMALY", "IMPACT", "TILT_MISMATCH"].into_iter().any(turned), "{fault}: {judgement:?}");
    }
}

/// It turned over as it came down.
#[test]
fn a_motor_that_no_longer_listens_is_lost_and_the_others_stop() {
    let judgement = piloted(FlightMode::Acro, 1, &["motor-3-stuck=0.41@hover"]).judgement;
    assert_eq!(judgement.outcome, "cut", "{judgement:?}");
    assert!(judgement.cut_after_s.is_some_and(|after| after < 0.3), "{judgement:?}");
}

#[test]
fn a_motor_that_runs_by_itself_keeps_the_vehicle_from_arming() {
    let outcome = flown(&setup("arm\ntakeoff 0.5\nland\n", &["motor-1-stuck@ground"])).0;
    let alerts: Vec<_> = outcome.judgement.alerts.iter().map(|span| span.name).collect();
    assert!(alerts.contains(&"MOTOR_RUNS"), "{alerts:?}");
    let armed = |change: &stampfly_board::simulation::PhaseChange| change.phase == FlightPhase::Armed;
    assert!(!outcome.phases.iter().any(armed), "{:?}", outcome.phases);
}

/// It leaned on, over the leg that touched first.
#[test]
fn half_a_propeller_settles_upright() {
    let flight = setup("arm\ntakeoff 0.5\nhover 2\ngoto 1 0 0.7\nland\n", &["motor-2-thrust@hover"]);
    let reference = Setup::reference(1686);
    let pilot = Some(FlightMode::PosHold);
    let judgement = flown(&Setup { mission: flight.mission, faults: flight.faults, pilot, ..reference }).0.judgement;
    assert_eq!(judgement.outcome, "landed", "{judgement:?}");
}
