//! Height, place or link are lost.

use super::*;

#[test]
fn d2_a_mode_that_holds_height_never_becomes_a_throttle() {
    for mode in [FlightMode::AltHold, FlightMode::PosHold] {
        for lost in [Validity::VELOCITY_Z | Validity::HEIGHT, Validity::ALL.without(Validity::TILT)] {
            let (mut machine, mut world) = piloted(mode);
            world.estimate.valid = Validity::ALL.without(lost);
            for _ in 0..360 {
                let status = world.step(&mut machine, &[]).flight_status;
                assert!(!status.mode.is_manual() && status.phase == FlightPhase::Flying);
            }
            assert_eq!(world.pass(&mut machine, 200).phase, FlightPhase::Landing, "after a second");
        }
        let (mut machine, mut world) = piloted(mode);
        world.estimate.valid = Validity::TILT;
        world.pass(&mut machine, 900);
        world.estimate.valid = Validity::ALL;
        assert_eq!(world.pass(&mut machine, 3_000).phase, FlightPhase::Flying, "back in time");
    }
}

/// D8: without flow a program's flight drifted for as long as it took.
#[test]
fn d8_a_vehicle_adrift_lands_unless_a_pilot_flies_it() {
    let (mut machine, mut world) = in_phase(FlightPhase::Flying);
    world.estimate.valid = Validity::ALL.without(Validity::VELOCITY_XY | Validity::POSITION_XY);
    assert_eq!(world.pass(&mut machine, 900).phase, FlightPhase::Flying);
    assert_eq!(world.pass(&mut machine, 200).phase, FlightPhase::Landing, "after a second");
    let (mut machine, mut world) = in_phase(FlightPhase::Flying);
    for _ in 0..3 {
        world.estimate.valid = Validity::ALL.without(Validity::VELOCITY_XY | Validity::POSITION_XY);
        world.pass(&mut machine, 900);
        world.estimate.valid = Validity::ALL;
        assert_eq!(world.pass(&mut machine, 100).phase, FlightPhase::Flying, "a dark tile");
    }
    let (mut machine, mut world) = piloted(FlightMode::PosHold);
    world.estimate.valid = Validity::ALL.without(Validity::VELOCITY_XY | Validity::POSITION_XY);
    let status = world.pass(&mut machine, 5_000);
    assert_eq!((status.phase, status.mode), (FlightPhase::Flying, FlightMode::AltHold));
}

/// Its height is known by nothing else yet.
#[test]
fn a_take_off_whose_range_lies_is_broken_off() {
    let (mut machine, mut world) = in_phase(FlightPhase::TakeOff);
    world.alerts = Alerts::RANGE_IMPLAUSIBLE;
    assert_eq!(world.step(&mut machine, &[]).flight_status.phase, FlightPhase::Landing);
    let (mut machine, mut world) = in_phase(FlightPhase::Flying);
    world.alerts = Alerts::RANGE_IMPLAUSIBLE;
    assert_eq!(world.pass(&mut machine, 3_000).phase, FlightPhase::Flying, "in flight the barometer holds the height");
}

#[test]
fn the_estimator_is_told_when_propellers_carry_the_vehicle() {
    for (phase, flying) in [(FlightPhase::Flying, true), (FlightPhase::Landing, true), (FlightPhase::IdleGround, false)]
    {
        let (mut machine, mut world) = in_phase(phase);
        assert_eq!(world.step(&mut machine, &[]).estimator.flying, flying, "{phase:?}");
    }
    for mode in [FlightMode::Stabilize, FlightMode::AltHold] {
        for (throttle, flying) in [(0.0, mode == FlightMode::AltHold), (0.6, true)] {
            let (mut machine, mut world) = piloted(mode);
            let status = world.sends(&mut machine, frame(mode, true, throttle));
            assert_eq!((status.mode, status.commander), (mode, CommandSource::Pilot));
            assert_eq!(world.step(&mut machine, &[]).estimator.flying, flying, "{mode:?}, throttle {throttle}");
        }
    }
}

/// While it lands by itself, the landing makes the thrust: the stick may rest, and nobody may be heard.
#[test]
fn a_landing_carries_the_vehicle_wherever_the_throttle_is() {
    let (mut machine, mut world) = piloted(FlightMode::Stabilize);
    world.sends(&mut machine, frame(FlightMode::Stabilize, true, 0.6));
    world.alerts = Alerts::CRITICAL_BATTERY;
    let resting = frame(FlightMode::Stabilize, true, 0.0);
    let status = world.sends(&mut machine, resting);
    assert_eq!((status.phase, status.mode), (FlightPhase::Landing, FlightMode::Stabilize));
    assert!(world.step(&mut machine, &[]).estimator.flying, "the stick rests");
    world.pilot = None;
    let lands = world.pass(&mut machine, 1_000);
    assert_eq!((lands.phase, lands.mode), (FlightPhase::Landing, FlightMode::Stabilize));
    assert!(world.step(&mut machine, &[]).estimator.flying, "nobody is heard");
    let (mut machine, mut world) = piloted(FlightMode::Stabilize);
    world.sends(&mut machine, resting);
    assert!(!world.step(&mut machine, &[]).estimator.flying, "the pilot makes the thrust");
    world.pilot = None;
    assert!(world.step(&mut machine, &[]).estimator.flying, "a stick that is not heard rests nowhere");
}

#[test]
fn d13_a_link_that_flaps_is_lost() {
    let (mut machine, mut world) = in_phase(FlightPhase::Flying);
    let mut phase = FlightPhase::Flying;
    for _ in 0..3 {
        world.alerts = Alerts::COMM_LOST;
        phase = world.pass(&mut machine, 2_400).phase;
        world.alerts = Alerts::NONE;
        phase = phase.max(world.pass(&mut machine, 700).phase);
    }
    assert_eq!(phase, FlightPhase::Landing);
}

#[test]
fn d13_a_link_that_is_back_for_a_second_is_back() {
    let (mut machine, mut world) = in_phase(FlightPhase::Flying);
    for _ in 0..5 {
        world.alerts = Alerts::COMM_LOST;
        assert_eq!(world.pass(&mut machine, 2_000).phase, FlightPhase::Flying);
        world.alerts = Alerts::NONE;
        assert_eq!(world.pass(&mut machine, 1_100).phase, FlightPhase::Flying);
    }
}

#[test]
fn a_lost_link_hovers_then_lands() {
    let (mut machine, mut world) = in_phase(FlightPhase::Flying);
    world.alerts = Alerts::COMM_LOST;
    let landed_after = (0..2_000).find(|_| world.step(&mut machine, &[]).flight_status.phase == FlightPhase::Landing);
    assert_eq!(landed_after, Some(1_200), "3 s at 400 Hz");
    world.alerts = Alerts::NONE;
    assert_eq!(
        world.step(&mut machine, &[]).flight_status.phase,
        FlightPhase::Landing,
        "a link that returns is no reason to stop"
    );
}

#[test]
fn another_vehicle_waits_as_long_as_its_configuration_says() {
    let second = Duration::from_secs(1);
    let config = ModeConfig { hover_without_link: second, armed_timeout: second * 2, ..ModeConfig::default() };
    let (mut machine, mut world) = (ModeMachine::new(config), World::ready());
    world.step(&mut machine, &[]);
    assert!(world.step(&mut machine, &[Command::Arm]).flight_status.armed);
    let disarmed_after = (1..2_000).find(|_| !world.step(&mut machine, &[]).flight_status.armed);
    assert_eq!(disarmed_after, Some(800), "2 s at 400 Hz");

    (machine, world) = in_phase(FlightPhase::Flying);
    machine.config = config;
    world.alerts = Alerts::COMM_LOST;
    let landed_after = (0..2_000).find(|_| world.step(&mut machine, &[]).flight_status.phase == FlightPhase::Landing);
    assert_eq!(landed_after, Some(400), "1 s at 400 Hz");
}

#[test]
fn what_lifts_nothing_stops_its_motors_at_take_off_and_lands_in_flight() {
    for (phase, next) in [(FlightPhase::TakeOff, FlightPhase::IdleGround), (FlightPhase::Flying, FlightPhase::Landing)]
    {
        let (mut machine, mut world) = in_phase(phase);
        (world.alerts, world.estimate.height, world.land_detected.contact) =
            (Alerts::NO_LIFT, 0.05, GroundContact::Ground);
        assert_eq!(world.step(&mut machine, &[Command::None]).flight_status.phase, next, "{phase:?}");
    }
}
