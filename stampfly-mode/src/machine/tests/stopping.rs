//! What stops the motors, and who may ask for it: commands, switches, the button, the cut-off, a crash.

use super::*;

/// On the ground after a blow in flight.
fn crashed() -> (ModeMachine, World) {
    let (mut machine, mut world) = in_phase(FlightPhase::Flying);
    world.alerts = Alerts::IMPACT;
    world.step(&mut machine, &[]);
    world.alerts = Alerts::NONE;
    world.estimate.height = 0.03;
    (machine, world)
}

#[test]
fn d11_what_ends_a_flight_wins_over_arming_in_any_order() {
    for end in [Command::Kill, Command::Disarm, Command::Land] {
        for commands in [[Command::Arm, end], [end, Command::Arm]] {
            let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
            let output = world.step(&mut machine, &commands);
            assert!(!output.flight_status.armed && output.refused, "{commands:?}");
            assert!(!world.pass(&mut machine, 100).armed, "{commands:?}");
        }
    }
}

#[test]
fn d11_a_kill_switch_that_is_held_refuses_arming() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    for arm in [false, true] {
        let killed = PilotInput { kill: true, ..frame(FlightMode::PosHold, arm, 0.0) };
        assert_eq!(world.sends(&mut machine, killed).blocks, ArmBlocks::KILL);
    }
    assert!(!world.step(&mut machine, &[Command::Arm]).flight_status.armed, "nor does a program");
}

#[test]
fn d6_one_switch_off_lands_and_only_a_second_one_stops_the_motors() {
    let (mut machine, mut world) = piloted(FlightMode::PosHold);
    let [on, off] = [true, false].map(|arm| frame(FlightMode::PosHold, arm, 0.0));
    assert_eq!(world.sends(&mut machine, off).phase, FlightPhase::Landing);
    assert_eq!(world.pass(&mut machine, 1_000).phase, FlightPhase::Landing);
    assert_eq!(world.sends(&mut machine, on).phase, FlightPhase::Landing);
    let stopped = world.sends(&mut machine, off);
    assert!(!stopped.armed);
    let crashed = world.step(&mut machine, &[]).flight_status.blocks.contains(ArmBlocks::CRASHED);
    assert!(crashed, "stopped in the air");
    world.estimate.height = 0.03;
    world.land_detected.contact = GroundContact::Ground;
    assert!(!world.sends(&mut machine, on).armed, "to be acknowledged");
    world.sends(&mut machine, off);
    assert!(world.sends(&mut machine, on).armed);
}

#[test]
fn d6_a_switch_off_in_a_landing_for_another_reason_does_not_stop_the_motors() {
    let [on, off] = [true, false].map(|arm| frame(FlightMode::PosHold, arm, 0.0));
    let landing = || {
        let (mut machine, mut world) = piloted(FlightMode::PosHold);
        world.alerts = Alerts::CRITICAL_BATTERY;
        assert_eq!(world.pass(&mut machine, 300).phase, FlightPhase::Landing);
        (machine, world)
    };
    let (mut machine, mut world) = landing();
    assert_eq!(world.sends(&mut machine, off).phase, FlightPhase::Landing);
    assert_eq!(world.pass(&mut machine, 1_000).phase, FlightPhase::Landing);
    world.sends(&mut machine, on);
    assert!(!world.sends(&mut machine, off).armed, "off, on, off is meant");

    let (mut machine, mut world) = landing();
    world.estimate.height = 0.14;
    assert!(!world.sends(&mut machine, off).armed, "at the ground");
}

#[test]
fn d6_a_transmitter_that_restarts_never_stops_the_motors_in_the_air() {
    for (mode, phase) in [
        (FlightMode::PosHold, FlightPhase::Landing),
        (FlightMode::PosHold, FlightPhase::Flying),
        (FlightMode::Stabilize, FlightPhase::Flying),
    ] {
        let (mut machine, mut world) = piloted(mode);
        world.pilot = None;
        (world.alerts, world.sticks) = (Alerts::COMM_LOST, Some(CommandSource::Failsafe));
        world.pass(&mut machine, if phase == FlightPhase::Landing { 3_100 } else { 1_000 });
        assert_eq!(machine.state.phase, phase);
        (world.alerts, world.sticks) = (Alerts::NONE, None);
        let status = world.sends(&mut machine, frame(mode, false, 0.0));
        assert_eq!((status.phase, status.armed), (FlightPhase::Landing, true), "{mode:?}");
        assert!(world.pass(&mut machine, 2_000).armed);
    }
}

#[test]
fn d6_bad_frames_do_not_drop_a_flight() {
    for mode in [FlightMode::Stabilize, FlightMode::PosHold] {
        let (mut machine, mut world) = piloted(mode);
        let sent = world.pilot.expect("frames");
        for _ in 0..5 {
            world.pilot = Some(PilotInput { arm: false, ..sent });
            world.pass(&mut machine, 40);
            world.pilot = Some(sent);
            assert_eq!(world.pass(&mut machine, 60).phase, FlightPhase::Flying, "{mode:?}");
        }
        let status = world.sends(&mut machine, PilotInput { arm: false, ..sent });
        assert_eq!(status.armed, !mode.is_manual(), "turned off");
    }
}

#[test]
fn a_cut_off_is_a_block_until_it_is_acknowledged() {
    let (mut machine, mut world) = in_phase(FlightPhase::Flying);
    world.cut_off = true;
    assert_eq!(world.step(&mut machine, &[]).flight_status.phase, FlightPhase::IdleGround);
    world.cut_off = false;
    world.estimate.height = 0.03;
    assert_eq!(world.pass(&mut machine, 1_000).blocks, ArmBlocks::CUT_OFF);
    assert!(!world.step(&mut machine, &[Command::Arm]).flight_status.armed);
    world.step(&mut machine, &[Command::Disarm]);
    assert!(world.step(&mut machine, &[Command::Arm]).flight_status.armed);
}

#[test]
fn a_press_stops_the_motors_in_every_state_and_means_nothing_else() {
    use ButtonGesture::{Click, DoubleClick, HoldPair, HoldReset, Press};
    let millis = Duration::from_millis;
    for phase in [FlightPhase::Armed, FlightPhase::TakeOff, FlightPhase::Flying, FlightPhase::Landing] {
        for rest in [Click, DoubleClick, HoldPair, HoldReset] {
            let (mut machine, mut world) = in_phase(phase);
            let stopped = press(&mut world, &mut machine, Duration::ZERO, Press);
            assert_eq!((stopped.phase, stopped.armed), (FlightPhase::IdleGround, false), "{phase:?}");
            world.estimate.height = 0.03;
            let later = press(&mut world, &mut machine, millis(3_000), rest);
            assert!(!later.armed && !later.pairing, "{phase:?} {rest:?}");
            // A hand in a hurry presses again.
            for (after, gesture) in [(300, Press), (500, Click), (1_500, Press), (500, Click), (900, Press)] {
                assert!(!press(&mut world, &mut machine, millis(after), gesture).armed, "{phase:?} {rest:?}");
            }
            assert!(!press(&mut world, &mut machine, millis(3_000), HoldPair).pairing, "{phase:?} {rest:?}");
            // Left alone for a while, it is a button again.
            assert!(!press(&mut world, &mut machine, millis(2_000), Press).armed);
            assert!(press(&mut world, &mut machine, millis(500), Click).armed, "{phase:?} {rest:?}");
        }
    }
}

#[test]
fn a_press_while_a_command_arms_stops_the_motors() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    world.button = Some(ButtonGesture::Press);
    assert!(!world.step(&mut machine, &[Command::Arm]).flight_status.armed, "in the same step");
    assert!(world.step(&mut machine, &[Command::Arm]).flight_status.armed);
    assert!(!press(&mut world, &mut machine, Duration::from_millis(500), ButtonGesture::Click).armed);
}

#[test]
fn a_press_that_acknowledges_a_crash_does_not_arm() {
    let (mut machine, mut world) = crashed();
    let millis = Duration::from_millis;
    press(&mut world, &mut machine, millis(5_000), ButtonGesture::Press);
    assert_eq!(world.step(&mut machine, &[]).flight_status.blocks, ArmBlocks::CRASHED, "not yet");
    assert!(!press(&mut world, &mut machine, millis(500), ButtonGesture::Click).armed);
    assert_eq!(world.step(&mut machine, &[]).flight_status.blocks, ArmBlocks::NONE);
    press(&mut world, &mut machine, millis(500), ButtonGesture::Press);
    assert!(press(&mut world, &mut machine, millis(500), ButtonGesture::Click).armed, "the next press does");
}

#[test]
fn a_crash_has_to_be_acknowledged() {
    let (mut machine, mut world) = crashed();
    assert!(!world.step(&mut machine, &[Command::Arm]).flight_status.armed);
    world.step(&mut machine, &[Command::Disarm]);
    assert!(world.step(&mut machine, &[Command::Arm]).flight_status.armed);
}

#[test]
fn a_program_that_repeats_disarm_does_not_fall() {
    let (mut machine, mut world) = in_phase(FlightPhase::Flying);
    for _ in 0..10 {
        assert_eq!(world.step(&mut machine, &[GuidedKind::Disarm]).flight_status.phase, FlightPhase::Landing);
    }
    world.estimate.height = 0.1;
    assert!(!world.step(&mut machine, &[GuidedKind::Disarm]).flight_status.armed);
}

/// What is told of a step is what it was decided by.
#[test]
fn what_is_acknowledged_in_a_step_refuses_in_it_and_is_told() {
    let (mut machine, mut world) = crashed();
    world.button = Some(ButtonGesture::Click);
    let output = world.step(&mut machine, &[]);
    assert_eq!((output.refused, output.flight_status.blocks), (true, ArmBlocks::CRASHED));
    assert_eq!(world.step(&mut machine, &[]).flight_status.blocks, ArmBlocks::NONE);
}
