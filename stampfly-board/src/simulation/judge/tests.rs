//! Flights that are made up, and what the judge says of them.

use super::*;
use crate::simulation::faults::FAULTS;
use stampfly_mode::transitions;
use stampfly_sim::fault::Fault;
use stampfly_types::Vec3;
use stampfly_types::messages::FlightStatus;

fn judge(faults: &[&str]) -> Judge {
    let faults: Vec<_> = faults.iter().filter_map(|text| Fault::parse(text, FAULTS).ok()).collect();
    let injector = Injector::new(Instant::ZERO, &faults);
    let mission = Mission::parse("arm\ntakeoff 0.5\ngoto 1 0 0.8\nland\n").expect("a mission");
    Judge::new(&injector, &mission, None, &VehicleConfig::default())
}

fn status(phase: FlightPhase) -> FlightStatus {
    FlightStatus { phase, armed: transitions::is_armed(phase), mode: FlightMode::PosHold, ..Default::default() }
}

/// Shows the judge a vehicle at this height, with this sink rate.
fn show(judge: &mut Judge, now: Instant, phase: FlightPhase, (up, sink): (f32, f32), done: usize) {
    show_struck(judge, now, phase, (up, sink), done, 0);
}

/// The same, pushed by a wall in so many steps since the start.
fn show_struck(judge: &mut Judge, now: Instant, phase: FlightPhase, (up, sink): (f32, f32), done: usize, strikes: u64) {
    let truth = Truth {
        position: Vec3::new(0.0, 0.0, -up),
        velocity: Vec3::new(0.0, 0.0, sink),
        contact: up <= 0.0,
        ..Default::default()
    };
    judge.see(&Sight { now, truth: &truth, clearance: up, strikes, status: &status(phase), done });
}

/// Flies up to 0.5 m, suffers the fault at 2 s, and stops the motors at `stop` seconds at this height.
fn flown(fault: &str, highest: f32, stop: Option<(f64, f32)>, touch: f32) -> Judgement {
    let mut judge = judge(&[fault]);
    let at = |seconds: f64| Instant::from_micros((seconds * 1e6) as u64);
    show(&mut judge, at(0.5), FlightPhase::Armed, (0.0, 0.0), 1);
    judge.motors(at(1.0), true);
    show(&mut judge, at(1.5), FlightPhase::Flying, (0.5, 0.0), 1);
    show(&mut judge, at(2.1), FlightPhase::Flying, (highest, 0.0), 1);
    if let Some((seconds, height)) = stop {
        show(&mut judge, at(seconds), FlightPhase::Flying, (height, touch), 2);
        judge.motors(at(seconds), false);
        show(&mut judge, at(seconds + 0.5), FlightPhase::IdleGround, (0.0, 0.0), 2);
    }
    judge.finish()
}

#[test]
fn ends_are_told_apart() {
    let fault = "baro-step@2";
    let outcome = |highest, stop, touch| flown(fault, highest, stop, touch).outcome;
    assert_eq!(outcome(1.6, Some((4.0, 0.1)), 0.3), "flown-away");
    assert_eq!(outcome(0.5, None, 0.0), "kept-on");
    assert_eq!(outcome(0.5, Some((2.25, 0.5)), 3.0), "cut");
    assert_eq!(outcome(0.5, Some((2.35, 0.5)), 3.0), "crashed");
    assert_eq!(outcome(0.5, Some((4.0, 0.0)), 0.3), "landed");
    let cut = flown(fault, 0.5, Some((2.25, 0.4)), 3.0);
    assert!((cut.cut_after_s.unwrap_or_default() - 0.25).abs() < 1e-6, "{cut:?}");
    assert!((cut.cut_height_m.unwrap_or_default() - 0.4).abs() < 1e-6, "{cut:?}");
    assert_eq!(cut.touch_speed_mps, Some(3.0));
    assert!(cut.violations.contains(&"I12"), "nothing was changed: {cut:?}");
    assert_eq!(judge(&[fault]).finish().outcome, "refused");
}

#[test]
fn of_two_faults_one_may_stop_the_motors_if_they_are_to_stop_for_it() {
    let ends = |second: &str, stop: f64| {
        let mut judge = judge(&["baro-step@2", second]);
        let at = |seconds: f64| Instant::from_micros((seconds * 1e6) as u64);
        show(&mut judge, at(0.5), FlightPhase::Armed, (0.0, 0.0), 1);
        judge.motors(at(1.0), true);
        show(&mut judge, at(1.5), FlightPhase::Flying, (0.5, 0.0), 1);
        show(&mut judge, at(2.1), FlightPhase::Flying, (0.5, 0.0), 1);
        if stop > 4.1 {
            show(&mut judge, at(4.1), FlightPhase::Flying, (0.5, 0.0), 1);
        }
        show(&mut judge, at(stop), FlightPhase::Flying, (0.5, 3.0), 2);
        judge.motors(at(stop), false);
        show(&mut judge, at(stop + 0.5), FlightPhase::IdleGround, (0.0, 0.0), 2);
        judge.finish().outcome
    };
    assert_eq!(ends("imu-silent@4", 4.2), "cut");
    assert_eq!(ends("imu-silent@4", 4.4), "crashed", "too late");
    assert_eq!(ends("tof-silent@4", 4.2), "crashed", "a range finder is no reason to fall");
    assert_eq!(ends("imu-silent@6", 2.2), "crashed", "nor is a barometer, though another fault follows");
}

/// Flies to the mission's end with a fault that begins when it touches, and stops the motors 0.2 s later at this height.
fn landed(height: f32, sink: f32) -> &'static str {
    let mut judge = judge(&["baro-step@4"]);
    let at = |seconds: f64| Instant::from_micros((seconds * 1e6) as u64);
    show(&mut judge, at(0.5), FlightPhase::Armed, (0.0, 0.0), 1);
    judge.motors(at(1.0), true);
    let there = Truth { position: Vec3::new(1.0, 0.0, -0.8), ..Default::default() };
    let flying = status(FlightPhase::Flying);
    judge.see(&Sight { now: at(2.0), truth: &there, clearance: 0.8, strikes: 0, status: &flying, done: 2 });
    show(&mut judge, at(3.9), FlightPhase::Landing, (0.4, sink), 3);
    show(&mut judge, at(4.1), FlightPhase::Landing, (height, sink), 3);
    judge.motors(at(4.2), false);
    show(&mut judge, at(5.0), FlightPhase::IdleGround, (0.0, 0.0), 3);
    judge.finish().outcome
}

#[test]
fn motors_that_a_landing_stops_were_not_cut() {
    assert_eq!(landed(0.0, 0.3), "transparent");
    assert_eq!(landed(0.2, 0.3), "cut", "in the air");
    assert_eq!(landed(0.0, 1.5), "cut", "not a landing");
}

#[test]
fn motors_that_stop_after_a_blow_were_cut_by_it() {
    let stopped = |blow: f64, stop: f64| {
        let mut judge = judge(&["wall@1.5"]);
        let at = |seconds: f64| Instant::from_micros((seconds * 1e6) as u64);
        judge.motors(at(1.0), true);
        show(&mut judge, at(2.0), FlightPhase::Flying, (0.5, 0.0), 1);
        show_struck(&mut judge, at(2.5), FlightPhase::Flying, (0.5, 0.0), 1, 1);
        show_struck(&mut judge, at(blow), FlightPhase::Flying, (0.5, 0.0), 1, 2);
        judge.motors(at(stop), false);
        show_struck(&mut judge, at(stop + 0.5), FlightPhase::IdleGround, (0.0, 3.0), 1, 3);
        show_struck(&mut judge, at(stop + 0.6), FlightPhase::IdleGround, (0.0, 0.0), 1, 3);
        judge.finish().outcome
    };
    assert_eq!(stopped(4.0, 4.2), "cut", "by the second");
    assert_ne!(stopped(4.0, 4.4), "cut", "too late");
}

#[test]
fn a_blow_counts_that_was_not_seen_before_the_motors_stopped() {
    let stopped = |strikes: u64| {
        let mut judge = judge(&["wall@1.5"]);
        let at = |seconds: f64| Instant::from_micros((seconds * 1e6) as u64);
        judge.motors(at(1.0), true);
        show(&mut judge, at(4.0), FlightPhase::Flying, (0.5, 0.0), 1);
        judge.strikes(at(4.002), strikes);
        judge.motors(at(4.002), false);
        show_struck(&mut judge, at(4.5), FlightPhase::IdleGround, (0.0, 3.0), 1, 2);
        show_struck(&mut judge, at(4.6), FlightPhase::IdleGround, (0.0, 0.0), 1, 2);
        judge.finish().outcome
    };
    assert_eq!(stopped(1), "cut");
    assert_ne!(stopped(0), "cut", "struck afterwards");
}
