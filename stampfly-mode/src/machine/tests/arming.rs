//! What refuses arming.

use super::*;

#[test]
fn d9_a_vehicle_without_its_sensors_does_not_arm() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    world.alerts = SENSORS_LOST;
    let output = world.step(&mut machine, &[Command::Arm]);
    let missing = ArmBlocks::NO_RANGE | ArmBlocks::NO_FLOW | ArmBlocks::NO_BARO;
    assert_eq!((output.flight_status.armed, output.flight_status.blocks, output.refused), (false, missing, true));
    assert_eq!(machine.refusals().count(), 3);
}

#[test]
fn the_arm_switch_of_a_new_transmitter_must_be_seen_off() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    world.sends(&mut machine, frame(FlightMode::PosHold, false, 0.0));
    world.button = Some(ButtonGesture::HoldPair);
    world.step(&mut machine, &[]);
    world.pilot = None;
    world.pass(&mut machine, 1_000);
    let [on, off] = [true, false].map(|arm| frame(FlightMode::PosHold, arm, 0.0));
    assert!(!world.sends(&mut machine, on).pairing);
    assert!(!world.sends(&mut machine, on).armed, "switched on before it was seen off");
    world.sends(&mut machine, off);
    assert!(world.sends(&mut machine, on).armed);
}

#[test]
fn turning_the_mode_switch_of_an_armed_vehicle_does_not_take_off() {
    for (from, to, throttle) in
        [(FlightMode::Stabilize, FlightMode::AltHold, 0.0), (FlightMode::AltHold, FlightMode::Stabilize, 0.6)]
    {
        let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
        world.sends(&mut machine, frame(from, false, throttle));
        assert!(world.sends(&mut machine, frame(from, true, throttle)).armed);
        machine.state.takes_off = false;
        let status = world.sends(&mut machine, frame(to, true, throttle));
        assert_eq!(status.mode, to);
        assert_eq!(world.pass(&mut machine, 2_000).phase, FlightPhase::Armed, "{from:?} to {to:?}");
        world.sends(&mut machine, frame(to, true, 0.0));
        assert_eq!(world.sends(&mut machine, frame(to, true, 0.3)).phase, FlightPhase::TakeOff);
    }
}

#[test]
fn a_switch_that_was_on_at_boot_does_not_arm() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    let [on, off] = [true, false].map(|arm| frame(FlightMode::PosHold, arm, 0.0));
    assert!(!world.sends(&mut machine, on).armed);
    assert!(machine.refusals().any(|refusal| refusal.check == ArmBlocks::ARM_SWITCH));
    world.sends(&mut machine, off);
    assert!(world.sends(&mut machine, on).armed, "off, then on");
}

#[test]
fn a_vehicle_that_hears_neither_pilot_nor_program_does_not_arm() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    world.alerts = Alerts::COMM_LOST;
    for gesture in [ButtonGesture::Press, ButtonGesture::Click] {
        world.button = Some(gesture);
        let mode = world.step(&mut machine, &[]).flight_status;
        assert_eq!((mode.armed, mode.blocks), (false, ArmBlocks::NO_LINK), "{gesture:?}");
    }
    assert!(world.step(&mut machine, &[Command::Arm]).flight_status.armed, "a command is a sign of life itself");
}

#[test]
fn a_click_counts_only_when_nothing_blocked_arming_as_the_button_went_down() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    let mut gesture = |alerts, gesture| {
        world.alerts = alerts;
        world.button = Some(gesture);
        let output = world.step(&mut machine, &[]);
        (output.flight_status.armed, output.refused)
    };
    assert_eq!(gesture(Alerts::COMM_LOST, ButtonGesture::Press), (false, false));
    // The transmitter comes on before the click is known.
    assert_eq!(gesture(Alerts::NONE, ButtonGesture::Click), (false, true));
    assert_eq!(gesture(Alerts::NONE, ButtonGesture::Press), (false, false));
    assert_eq!(gesture(Alerts::NONE, ButtonGesture::Click), (true, false));
}

#[test]
fn a_mode_that_holds_height_does_not_arm_without_one() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    world.estimate.valid = Validity::TILT;
    for arm in [false, true] {
        let mode = world.sends(&mut machine, frame(FlightMode::AltHold, arm, 0.6));
        assert_eq!((mode.armed, mode.mode, mode.blocks), (false, FlightMode::AltHold, ArmBlocks::ESTIMATE));
    }
    world.estimate.valid = Validity::ALL;
    for arm in [false, true] {
        world.sends(&mut machine, frame(FlightMode::AltHold, arm, 0.6));
    }
    assert!(machine.state.is_armed(), "a raised stick is a climb rate, and no reason");
}

#[test]
fn the_machine_blocks_arming_at_the_tilt_of_its_configuration() {
    let tilted = stampfly_types::Quat::from_euler_angles(0.2, 0.0, 0.0);
    for (arming_tilt, blocks) in [(0.15, ArmBlocks::TILTED), (0.25, ArmBlocks::NONE)] {
        let mut machine = ModeMachine::new(ModeConfig { arming_tilt, ..ModeConfig::default() });
        let mut world = World::ready();
        world.estimate.attitude = tilted;
        world.step(&mut machine, &[]);
        assert_eq!(world.step(&mut machine, &[]).flight_status.blocks, blocks);
    }
}

#[test]
fn an_armed_vehicle_has_no_refusals() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    world.alerts = Alerts::LOW_BATTERY;
    assert!(world.step(&mut machine, &[Command::Arm]).refused);
    assert_eq!(machine.refusals().count(), 1);
    world.alerts = Alerts::NONE;
    assert!(world.step(&mut machine, &[Command::Arm]).flight_status.armed);
    assert_eq!(machine.refusals().count(), 0);
    assert_eq!(world.pass(&mut machine, 100).blocks, ArmBlocks::NOT_ON_GROUND);
    assert_eq!(machine.refusals().count(), 0);
}

#[test]
fn arming_is_refused_to_whoever_asked_for_it_and_to_nobody_else() {
    let refused = |asks: fn(&mut World, &mut ModeMachine) -> ModeOutput| {
        let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
        world.alerts = Alerts::LOW_BATTERY;
        world.sends(&mut machine, frame(FlightMode::PosHold, false, 0.0));
        asks(&mut world, &mut machine).refused
    };
    assert!(refused(|world, machine| world.step(machine, &[Command::Arm])));
    assert!(refused(|world, machine| {
        world.button = Some(ButtonGesture::Click);
        world.step(machine, &[])
    }));
    assert!(refused(|world, machine| {
        world.pilot = Some(frame(FlightMode::PosHold, true, 0.0));
        let outputs = (0..100).map(|_| world.step(machine, &[]));
        outputs.reduce(|all, output| ModeOutput { refused: all.refused || output.refused, ..output }).expect("steps")
    }));
    assert!(!refused(|world, machine| world.step(machine, &[Command::Hold])));
    assert!(!refused(|world, machine| {
        world.button = Some(ButtonGesture::Press);
        world.step(machine, &[])
    }));
}

/// The old transmitter's switch was seen off, and its last frame is fresh until the new one's comes.
#[test]
fn the_arm_switch_of_a_new_transmitter_must_be_seen_off_though_there_was_no_silence() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    let [on, off] = [true, false].map(|arm| frame(FlightMode::PosHold, arm, 0.0));
    world.sends(&mut machine, off);
    world.button = Some(ButtonGesture::HoldPair);
    world.step(&mut machine, &[]);
    assert!(world.pass(&mut machine, 180).pairing);
    world.pilot = Some(on);
    let status = world.pass(&mut machine, 1_000);
    assert_eq!((status.pairing, status.armed, status.blocks), (false, false, ArmBlocks::ARM_SWITCH));
    world.sends(&mut machine, off);
    assert!(world.sends(&mut machine, on).armed);
}

/// The heights of standing and lifted are the airframe's: a range finder may stand higher than a hand lifts a small vehicle.
#[test]
fn a_vehicle_whose_range_finder_stands_high_arms_with_its_own_heights() {
    for (config, arms) in [
        (ModeConfig::default(), false),
        (ModeConfig { standing_height: 0.2, held_height: 0.3, ..ModeConfig::default() }, true),
    ] {
        let (mut machine, mut world) = (ModeMachine::new(config), World::ready());
        world.estimate.height = 0.16;
        world.pass(&mut machine, 100);
        assert_eq!(world.step(&mut machine, &[Command::Arm]).flight_status.armed, arms, "{config:?}");
        let held = machine.refusals().any(|refusal| refusal.check == ArmBlocks::NOT_ON_GROUND);
        assert!(arms || held, "and it says why");
    }
}
