//! Every invariant can fail, each by itself.

use super::*;
use stampfly_types::Vec3;
use stampfly_types::messages::{ArmBlocks, FlightMode, FlightPhase, GuidedCommand, ImuData, PilotInput};
use std::vec::Vec;

fn new() -> Invariants {
    Invariants::new(Duration::from_secs(3))
}

fn publish(flight: &mut Invariants, id: Id, at: Instant, message: &impl Message) {
    flight.published(id, at, message.to_words().as_ref());
}

fn status(phase: FlightPhase) -> FlightStatus {
    FlightStatus { phase, armed: transitions::is_armed(phase), mode: FlightMode::PosHold, ..Default::default() }
}

#[test]
fn every_invariant_of_a_topic_can_fail() {
    let armed = status(FlightPhase::Armed);
    let duties = |duty: f32| MotorOutput { duty: [duty; 8], count: 4, ..Default::default() };
    let violated = |messages: &mut dyn FnMut(&mut Invariants)| {
        let mut invariants = new();
        messages(&mut invariants);
        invariants.violations.into_iter().collect::<Vec<_>>()
    };
    let at = Instant::from_secs;
    assert_eq!(violated(&mut |_| {}), Vec::<&str>::new());
    for duty in [f32::NAN, -0.1, 1.1] {
        let mut broken = |flight: &mut Invariants| {
            flight.status = armed;
            publish(flight, Id::actuator_motor, at(2), &duties(duty));
        };
        assert_eq!(violated(&mut broken), ["I1"]);
    }
    assert_eq!(violated(&mut |flight| publish(flight, Id::actuator_motor, at(1), &duties(0.5))), ["I2"]);
    let blocked = FlightStatus { blocks: ArmBlocks::LOW_BATTERY, ..armed };
    let mut arms = |flight: &mut Invariants| {
        flight.status = status(FlightPhase::IdleGround);
        publish(flight, Id::flight_status, at(1), &blocked);
    };
    assert_eq!(violated(&mut arms), ["I3"]);
    let lost = StateEstimate { velocity: Vec3::new(f32::INFINITY, 0.0, 0.0), ..Default::default() };
    assert_eq!(violated(&mut |flight| publish(flight, Id::estimate_state, at(1), &lost)), ["I4"]);
    let mut jumps = |flight: &mut Invariants| publish(flight, Id::flight_status, at(1), &status(FlightPhase::Flying));
    assert_eq!(violated(&mut jumps), ["I5"]);
    let mut silent = |flight: &mut Invariants| {
        flight.status = armed;
        publish(flight, Id::command_pilot, at(1), &PilotInput::default());
        publish(flight, Id::system_alert, at(2), &SystemAlert::default());
    };
    assert_eq!(violated(&mut silent), ["I6"]);
    let mut back = |flight: &mut Invariants| {
        publish(flight, Id::sensor_imu, at(2), &ImuData::default());
        publish(flight, Id::sensor_imu, at(1), &ImuData::default());
    };
    assert_eq!(violated(&mut back), ["I9"]);
}

#[test]
fn motors_that_turn_without_samples_or_after_their_time_to_land_are_found() {
    let mut flight = new();
    publish(&mut flight, Id::sensor_imu, Instant::from_millis(1000), &ImuData::default());
    flight.motors(true);
    flight.see(Instant::from_millis(1057), 0.6);
    assert!(flight.violations.is_empty());
    flight.see(Instant::from_millis(1058), 0.6);
    assert_eq!(flight.violations, BTreeSet::from(["I7"]));

    // 3 s, and 2 s for 0.6 m.
    let alert = SystemAlert { active: Alerts::CRITICAL_BATTERY, seen: Alerts::CRITICAL_BATTERY };
    flight.violations.clear();
    publish(&mut flight, Id::system_alert, Instant::from_millis(1100), &alert);
    for (milliseconds, expected) in [(6099, false), (6101, true)] {
        let now = Instant::from_millis(milliseconds);
        publish(&mut flight, Id::sensor_imu, now, &ImuData::default());
        flight.see(now, 0.6);
        assert_eq!(flight.violations.contains("I10"), expected, "{milliseconds}");
    }
}

#[test]
fn a_program_does_not_speak_for_a_silent_pilot() {
    for (commander, expected) in [(CommandSource::Pilot, true), (CommandSource::Guided, false)] {
        let mut flight = new();
        flight.status = FlightStatus { commander, ..status(FlightPhase::Flying) };
        publish(&mut flight, Id::command_pilot, Instant::from_secs(1), &PilotInput::default());
        publish(&mut flight, Id::command_guided, Instant::from_secs(2), &GuidedCommand::default());
        publish(&mut flight, Id::system_alert, Instant::from_secs(2), &SystemAlert::default());
        assert_eq!(flight.violations.contains("I6"), expected, "{commander:?}");
    }
}
