//! Who commands: pilot or program, and which flight mode follows.

use super::*;

#[test]
fn d4_a_pilot_lost_in_a_manual_mode_is_replaced_by_a_hold_and_a_landing() {
    for mode in [FlightMode::Stabilize, FlightMode::Acro] {
        for (valid, expected) in
            [(Validity::ALL, FlightMode::PosHold), (Validity::ALL.without(Validity::POSITION_XY), FlightMode::AltHold)]
        {
            let (mut machine, mut world) = piloted(mode);
            world.estimate.valid = valid;
            assert_eq!(world.pass(&mut machine, 400).mode, mode, "a short gap is none");
            (world.pilot, world.alerts, world.sticks) = (None, Alerts::COMM_LOST, Some(CommandSource::Failsafe));
            let status = world.step(&mut machine, &[]).flight_status;
            assert_eq!((status.phase, status.mode), (FlightPhase::Flying, expected));
            assert_eq!(world.pass(&mut machine, 2_900).phase, FlightPhase::Flying);
            assert_eq!(world.pass(&mut machine, 200).phase, FlightPhase::Landing);
        }
        let (mut machine, mut world) = piloted(mode);
        world.estimate.valid = Validity::TILT;
        assert_eq!(world.pass(&mut machine, 5_000).mode, mode, "a manual mode needs no height");
        (world.pilot, world.alerts, world.sticks) = (None, Alerts::COMM_LOST, Some(CommandSource::Failsafe));
        let status = world.step(&mut machine, &[]).flight_status;
        assert_eq!((status.phase, status.mode.is_manual()), (FlightPhase::Landing, false), "at once without height");
    }
}

#[test]
fn d4_a_pilot_who_comes_back_chooses_the_manual_mode_again() {
    let (mut machine, mut world) = piloted(FlightMode::Stabilize);
    let sent = world.pilot.take().expect("frames");
    (world.alerts, world.sticks) = (Alerts::COMM_LOST, Some(CommandSource::Failsafe));
    world.pass(&mut machine, 1_000);
    (world.alerts, world.sticks) = (Alerts::NONE, None);
    assert_eq!(world.sends(&mut machine, sent).mode, FlightMode::PosHold);
    world.sends(&mut machine, PilotInput { mode: FlightMode::PosHold, ..sent });
    assert_eq!(world.sends(&mut machine, sent).mode, FlightMode::AltHold);
    assert_eq!(world.sends(&mut machine, PilotInput { throttle: 0.6, ..sent }).mode, FlightMode::Stabilize);
}

/// A throttle stick with a spring rests in its centre, which is no thrust.
#[test]
fn a_manual_mode_begins_when_the_throttle_stick_has_passed_the_hover() {
    for mode in [FlightMode::Stabilize, FlightMode::Acro] {
        for (rests, passed) in [(0.0, 0.52), (-1.0, 1.0), (0.3, 0.5), (0.8, 0.45), (0.5, 0.49)] {
            for from in [FlightMode::PosHold, FlightMode::AltHold] {
                let (mut machine, mut world) = piloted(from);
                world.sends(&mut machine, frame(from, true, rests));
                assert_eq!(world.sends(&mut machine, frame(mode, true, rests)).mode, FlightMode::AltHold);
                assert_eq!(world.pass(&mut machine, 60_000).mode, FlightMode::AltHold, "however long it takes");
                world.step(&mut machine, &[Command::WayPoint]);
                assert_eq!(machine.state.commander, CommandSource::Pilot, "no program takes over from a manual flight");
                assert_eq!(world.sends(&mut machine, frame(mode, true, passed)).mode, mode, "{rests} to {passed}");
                assert_eq!(world.sends(&mut machine, frame(mode, true, rests)).mode, mode, "once is enough");
            }
        }
    }
}

/// Chatter of the switch is no way around it, and the mode that held the height is there again at once.
#[test]
fn a_manual_mode_that_is_taken_back_never_begins() {
    let (mut machine, mut world) = piloted(FlightMode::PosHold);
    for _ in 0..20 {
        for mode in [FlightMode::Stabilize, FlightMode::PosHold, FlightMode::Acro, FlightMode::AltHold] {
            let status = world.sends(&mut machine, frame(mode, true, 0.0));
            assert_eq!(status.mode, if mode.is_manual() { FlightMode::AltHold } else { mode });
        }
    }
    world.sends(&mut machine, frame(FlightMode::Acro, true, 0.0));
    let off = world.sends(&mut machine, frame(FlightMode::Acro, false, 0.0));
    assert_eq!(off.phase, FlightPhase::Landing, "the switch lands it, as in a mode that holds the height");
}

#[test]
fn from_one_manual_mode_to_another_nothing_is_waited_for() {
    let (mut machine, mut world) = piloted(FlightMode::Stabilize);
    assert_eq!(world.sends(&mut machine, frame(FlightMode::Acro, true, 0.2)).mode, FlightMode::Acro);
    assert_eq!(world.sends(&mut machine, frame(FlightMode::Stabilize, true, 0.0)).mode, FlightMode::Stabilize);
}

#[test]
fn a_take_off_in_acro_is_over_after_three_seconds_though_a_hand_holds_the_vehicle() {
    for (mode, phase) in [(FlightMode::Acro, FlightPhase::Flying), (FlightMode::Stabilize, FlightPhase::TakeOff)] {
        let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
        world.sends(&mut machine, frame(mode, false, 0.0));
        world.sends(&mut machine, frame(mode, true, 0.0));
        assert_eq!(world.sends(&mut machine, frame(mode, true, 0.3)).phase, FlightPhase::TakeOff);
        assert_eq!(world.pass(&mut machine, 2_500).phase, FlightPhase::TakeOff);
        assert_eq!(world.pass(&mut machine, 500).phase, phase, "{mode:?}");
    }
}

/// The switch is turned while the vehicle takes off: the mode comes when it flies.
#[test]
fn a_manual_mode_chosen_on_the_way_up_waits_for_the_throttle_too() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    world.sends(&mut machine, frame(FlightMode::AltHold, false, 0.0));
    world.sends(&mut machine, frame(FlightMode::AltHold, true, 0.0));
    assert_eq!(world.pass(&mut machine, 400).phase, FlightPhase::TakeOff);
    world.fly_at(0.3);
    world.sends(&mut machine, frame(FlightMode::Stabilize, true, 0.0));
    world.land_detected.takeoff_complete = true;
    let status = world.pass(&mut machine, 50);
    assert_eq!((status.phase, status.mode), (FlightPhase::Flying, FlightMode::AltHold));
    assert_eq!(world.sends(&mut machine, frame(FlightMode::Stabilize, true, 0.7)).mode, FlightMode::Stabilize);
}

#[test]
fn d14_sticks_that_do_not_arrive_on_board_end_a_manual_mode() {
    let (mut machine, mut world) = piloted(FlightMode::Stabilize);
    world.sticks = Some(CommandSource::Failsafe);
    let status = world.step(&mut machine, &[]).flight_status;
    assert_eq!((status.phase, status.mode), (FlightPhase::Flying, FlightMode::PosHold));
}

#[test]
fn d5_a_transmitter_that_is_merely_heard_takes_nothing_over() {
    for mode in FlightMode::ALL {
        for arm in [false, true] {
            let (mut machine, mut world) = in_phase(FlightPhase::Flying);
            let parked = PilotInput { yaw: 0.1, ..frame(*mode, arm, -1.0) };
            world.pilot = Some(parked);
            let status = world.pass(&mut machine, 5_000);
            assert_eq!(
                (status.phase, status.mode, status.commander),
                (FlightPhase::Flying, FlightMode::PosHold, CommandSource::Guided)
            );
        }
    }
}

#[test]
fn d5_a_pilot_takes_over_by_acting() {
    let parked = frame(FlightMode::Stabilize, false, 0.7);
    for (acts, mode) in [
        (PilotInput { roll: 0.4, ..parked }, FlightMode::PosHold),
        (PilotInput { mode: FlightMode::AltHold, ..parked }, FlightMode::AltHold),
        (PilotInput { mode: FlightMode::Acro, throttle: 0.0, ..parked }, FlightMode::AltHold),
        (PilotInput { arm: true, ..parked }, FlightMode::PosHold),
    ] {
        let (mut machine, mut world) = in_phase(FlightPhase::Flying);
        world.sends(&mut machine, parked);
        let status = world.sends(&mut machine, acts);
        assert_eq!((status.mode, status.commander), (mode, CommandSource::Pilot), "{acts:?}");
        world.step(&mut machine, &[Command::None]);
        assert_eq!(machine.state.commander, CommandSource::Pilot, "a sign of life is no command");
        world.pilot = Some(parked);
        world.step(&mut machine, &[Command::WayPoint]);
        let expected = if acts.mode == FlightMode::Acro { CommandSource::Pilot } else { CommandSource::Guided };
        assert_eq!(machine.state.commander, expected, "no program takes over from a pilot who waits for a manual mode");
    }
}

#[test]
fn d5_a_manual_mode_waits_for_its_throttle() {
    let (mut machine, mut world) = in_phase(FlightPhase::Flying);
    world.sends(&mut machine, frame(FlightMode::PosHold, false, 0.0));
    world.sticks = Some(CommandSource::Guided);
    let status = world.sends(&mut machine, frame(FlightMode::Stabilize, false, 0.0));
    assert_eq!((status.mode, status.commander), (FlightMode::PosHold, CommandSource::Pilot));
    world.sticks = None;
    assert_eq!(world.step(&mut machine, &[]).flight_status.mode, FlightMode::AltHold);
    assert_eq!(world.sends(&mut machine, frame(FlightMode::Stabilize, false, 0.6)).mode, FlightMode::Stabilize);
}

/// The table of `decision`: what a turned mode switch, and one that merely differs, do in every phase.
#[test]
fn d5_mode_arbitration_table() {
    use FlightPhase as S;
    for (phase, turned, differs) in [
        (S::Init, false, false),
        (S::IdleGround, true, true),
        (S::IdleHeld, false, false),
        (S::Armed, true, false),
        (S::TakeOff, false, false),
        (S::Flying, true, false),
        (S::Landing, false, false),
    ] {
        let start = || {
            let (mut machine, mut world) = in_phase(phase);
            world.calibration.complete = phase != S::Init;
            machine.state.wanted = FlightMode::PosHold;
            (machine, world)
        };
        let (mut machine, mut world) = start();
        world.sends(&mut machine, frame(FlightMode::AltHold, false, 0.0));
        assert_eq!(machine.state.wanted == FlightMode::AltHold, differs, "{phase:?}");

        let (mut machine, mut world) = start();
        world.sends(&mut machine, frame(FlightMode::PosHold, false, 0.0));
        world.sends(&mut machine, frame(FlightMode::AltHold, false, 0.0));
        assert_eq!(machine.state.wanted == FlightMode::AltHold, turned, "{phase:?}");
        assert_eq!(machine.state.pending.is_some(), !turned, "kept in {phase:?}");
        if phase == S::TakeOff {
            world.land_detected.takeoff_complete = true;
            let status = world.pass(&mut machine, 10);
            assert_eq!((status.phase, status.mode), (S::Flying, FlightMode::AltHold), "applied later");
        }
    }
    for (phase, set) in [(S::IdleGround, true), (S::Armed, true), (S::Flying, false)] {
        let (mut machine, mut world) = in_phase(phase);
        machine.state.wanted = FlightMode::AltHold;
        world.alerts = SENSORS_LOST;
        world.step(&mut machine, &[Command::Hold]);
        assert_eq!(machine.state.wanted == FlightMode::PosHold, set, "a program in {phase:?}");
    }
}
