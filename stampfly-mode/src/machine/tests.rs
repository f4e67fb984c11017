//! The machine from outside, step by step: phases, events, the arm switch, the button, crashes.

use super::*;
use stampfly_types::Duration;
use stampfly_types::messages::{ArmBlocks, CalibrationResult, GuidedKind, LandDetected, PilotInput, StateEstimate};
use std::collections::BTreeSet;
use std::vec;
use std::vec::Vec;

/// A situation the machine can be put into.
#[derive(Clone)]
struct World {
    estimate: StateEstimate,
    calibration: CalibrationResult,
    land_detected: LandDetected,
    alerts: Alerts,
    pilot: Option<PilotInput>,
    /// Happens in the next step, and not again.
    button: Option<ButtonGesture>,
    now: Instant,
}

impl World {
    fn ready() -> Self {
        Self {
            estimate: StateEstimate { height: 0.03, valid: Validity::ALL, ..Default::default() },
            calibration: CalibrationResult { complete: true, ..Default::default() },
            land_detected: LandDetected::default(),
            alerts: Alerts::NONE,
            pilot: None,
            button: None,
            now: Instant::ZERO,
        }
    }

    fn step(&mut self, machine: &mut ModeMachine, commands: &[Command]) -> ModeOutput {
        self.now += Duration::from_micros(2_500);
        let input = ModeInput {
            alerts: self.alerts,
            estimate: &self.estimate,
            calibration: &self.calibration,
            land_detected: &self.land_detected,
            pilot: self.pilot.as_ref(),
            commands,
            button: self.button.take(),
        };
        machine.step(self.now, &input)
    }
}

#[test]
fn pairing_ends_with_the_first_frame_after_a_silence_and_its_arm_switch_must_be_seen_off() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    let hold = |world: &mut World, machine: &mut ModeMachine| {
        world.button = Some(ButtonGesture::HoldPair);
        world.step(machine, &[]).flight_status.pairing
    };
    world.pilot = Some(PilotInput::default());
    world.step(&mut machine, &[]);
    assert!(hold(&mut world, &mut machine));
    assert!(world.step(&mut machine, &[]).flight_status.pairing, "a frame from before is still fresh");
    assert!(!hold(&mut world, &mut machine), "the pilot has changed his mind");
    assert!(hold(&mut world, &mut machine));
    world.pilot = None;
    assert!(world.step(&mut machine, &[]).flight_status.pairing);
    world.pilot = Some(PilotInput { arm: true, ..Default::default() });
    let paired = world.step(&mut machine, &[]).flight_status;
    assert!(!paired.pairing && !paired.armed);
    assert!(!world.step(&mut machine, &[]).flight_status.armed, "switched on before it was seen off");
    world.pilot = Some(PilotInput::default());
    world.step(&mut machine, &[]);
    world.pilot = Some(PilotInput { arm: true, ..Default::default() });
    assert!(world.step(&mut machine, &[]).flight_status.armed);
}

/// What happens to the world before a command.
type Change = fn(&mut World);

fn in_phase(phase: FlightPhase) -> (ModeMachine, World) {
    let (mut machine, mut world) = (ModeMachine::default(), World::ready());
    let path: &[(Command, Change)] = &[
        (Command::None, |_| {}),
        (Command::Arm, |_| {}),
        (Command::TakeOff, |_| {}),
        (Command::None, |world| world.land_detected.takeoff_complete = true),
        (Command::Land, |world| world.land_detected.takeoff_complete = false),
    ];
    for (command, change) in path {
        if machine.output.flight_status.phase == phase {
            break;
        }
        change(&mut world);
        world.step(&mut machine, &[*command]);
    }
    if phase == FlightPhase::IdleHeld {
        (machine, world) = in_phase(FlightPhase::IdleGround);
        world.estimate.height = 0.5;
        world.step(&mut machine, &[]);
    }
    world.land_detected.takeoff_complete = false;
    assert_eq!(machine.output.flight_status.phase, phase);
    (machine, world)
}

#[test]
fn every_state_can_be_reached_and_every_armed_one_ends_on_the_ground() {
    for &phase in FlightPhase::ALL {
        let (mut machine, mut world) = in_phase(phase);
        world.land_detected.landed = phase == FlightPhase::Landing;
        for command in [Command::Kill, Command::None] {
            world.step(&mut machine, &[command]);
        }
        assert!(!machine.output.flight_status.armed, "kill from {phase:?}");
    }
}

/// Every phase × every single alert and pair of alerts × every command and gesture: motors never start unasked, a
/// cutting alert or a gesture always stops them within the step, and only transitions of the table are taken.
#[test]
fn exhaustive_single_step() {
    let bits: Vec<Alerts> = Alerts::NAMES.iter().map(|(_, bit)| bits_to_alerts(*bit)).collect();
    let mut sets = vec![Alerts::NONE];
    for (i, a) in bits.iter().enumerate() {
        sets.extend(bits[i..].iter().map(|b| *a | *b));
    }
    let mut seen = BTreeSet::new();
    for &phase in FlightPhase::ALL {
        let start = in_phase(phase);
        for &alerts in &sets {
            let commands = GuidedKind::ALL.iter().map(|command| (Some(*command), ButtonGesture::None));
            for (command, gesture) in commands.chain(ButtonGesture::ALL.iter().map(|gesture| (None, *gesture))) {
                let (mut machine, mut world) = start.clone();
                (world.alerts, world.button) = (alerts, Some(gesture));
                let output = world.step(&mut machine, command.as_slice()).flight_status;
                assert_eq!(output.armed, is_armed(output.phase));
                if alerts.intersects(CUT) {
                    assert!(!output.armed, "{phase:?} {alerts:?} {command:?}");
                }
                if gesture != ButtonGesture::None && is_armed(phase) {
                    assert_eq!(output.phase, FlightPhase::IdleGround, "{phase:?} {alerts:?} {gesture:?}");
                }
                if output.armed && !is_armed(phase) {
                    let heard = command.is_some() || !alerts.contains(Alerts::COMM_LOST);
                    assert!(heard && phase == FlightPhase::IdleGround && output.blocks.is_empty());
                    assert!(command == Some(Command::Arm) || gesture == ButtonGesture::Click);
                }
                let legal = Event::ALL.iter().any(|e| next(phase, *e, true) == Some(output.phase));
                assert!(output.phase == phase || legal, "{phase:?} → {:?}", output.phase);
                seen.insert((phase, output.phase));
            }
        }
    }
    assert!(seen.len() > 12, "the exploration moved: {seen:?}");
}

fn bits_to_alerts(mask: u32) -> Alerts {
    use stampfly_types::Field;
    Alerts::read(&[mask]).expect("a named bit")
}

#[test]
fn a_switch_that_was_on_at_boot_does_not_arm() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    world.pilot = Some(PilotInput { arm: true, mode: FlightMode::PosHold, ..Default::default() });
    for _ in 0..10 {
        assert!(!world.step(&mut machine, &[]).flight_status.armed);
    }
    world.pilot = Some(PilotInput { arm: false, mode: FlightMode::PosHold, ..Default::default() });
    world.step(&mut machine, &[]);
    world.pilot = Some(PilotInput { arm: true, mode: FlightMode::PosHold, ..Default::default() });
    assert!(world.step(&mut machine, &[]).flight_status.armed, "off, then on");
}

#[test]
fn a_switch_that_moved_while_nobody_was_heard_does_not_arm() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    let frame = |arm| Some(PilotInput { arm, ..Default::default() });
    for pilot in [frame(false), None, frame(true)] {
        world.pilot = pilot;
        assert!(!world.step(&mut machine, &[]).flight_status.armed);
    }
    assert!(world.step(&mut machine, &[]).flight_status.blocks.contains(ArmBlocks::ARM_SWITCH));
    for pilot in [frame(false), frame(true)] {
        world.pilot = pilot;
        world.step(&mut machine, &[]);
    }
    assert!(machine.output.flight_status.armed, "seen off, then on");
    for pilot in [None, frame(false)] {
        world.pilot = pilot;
        world.step(&mut machine, &[]);
    }
    assert!(!machine.output.flight_status.armed, "but it disarms");
}

#[test]
fn nobody_arms_a_vehicle_that_hears_nobody() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    world.alerts = Alerts::COMM_LOST;
    for gesture in [ButtonGesture::Press, ButtonGesture::Click] {
        world.button = Some(gesture);
        let mode = world.step(&mut machine, &[]).flight_status;
        assert_eq!((mode.armed, mode.blocks), (false, ArmBlocks::NO_LINK), "{gesture:?}");
    }
    world.pilot = Some(PilotInput::default());
    world.step(&mut machine, &[]);
    world.pilot = Some(PilotInput { arm: true, ..Default::default() });
    assert!(!world.step(&mut machine, &[]).flight_status.armed, "the failsafe decides who is heard");
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    world.alerts = Alerts::COMM_LOST;
    assert!(world.step(&mut machine, &[Command::Arm]).flight_status.armed, "a command is a sign of life itself");
}

/// Lets time pass without a gesture, then one.
fn press(world: &mut World, machine: &mut ModeMachine, after: Duration, gesture: ButtonGesture) -> FlightStatus {
    world.now += after;
    world.button = Some(gesture);
    world.step(machine, &[]).flight_status
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
    assert!(!press(&mut world, &mut machine, Duration::ZERO, ButtonGesture::Press).armed);
    assert!(world.step(&mut machine, &[Command::Arm]).flight_status.armed);
    assert!(!press(&mut world, &mut machine, Duration::from_millis(500), ButtonGesture::Click).armed);
}

#[test]
fn a_press_that_acknowledges_a_crash_does_not_arm() {
    let (mut machine, mut world) = in_phase(FlightPhase::Flying);
    world.alerts = Alerts::IMPACT;
    world.step(&mut machine, &[]);
    world.alerts = Alerts::NONE;
    let millis = Duration::from_millis;
    press(&mut world, &mut machine, millis(5_000), ButtonGesture::Press);
    assert_eq!(world.step(&mut machine, &[]).flight_status.blocks, ArmBlocks::CRASHED, "not yet");
    assert!(!press(&mut world, &mut machine, millis(500), ButtonGesture::Click).armed);
    assert_eq!(world.step(&mut machine, &[]).flight_status.blocks, ArmBlocks::NONE);
    press(&mut world, &mut machine, millis(500), ButtonGesture::Press);
    assert!(press(&mut world, &mut machine, millis(500), ButtonGesture::Click).armed, "the next press does");
}

#[test]
fn a_raised_stick_does_not_arm_a_vehicle_that_cannot_hold_height() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    let frame = |arm| Some(PilotInput { arm, throttle: 0.6, mode: FlightMode::AltHold, ..Default::default() });
    world.estimate.valid = Validity::TILT;
    for arm in [false, true] {
        world.pilot = frame(arm);
        let mode = world.step(&mut machine, &[]).flight_status;
        assert_eq!((mode.armed, mode.mode, mode.blocks), (false, FlightMode::Stabilize, ArmBlocks::THROTTLE));
    }
    world.estimate.valid = Validity::ALL;
    for arm in [false, true] {
        world.pilot = frame(arm);
        world.step(&mut machine, &[]);
    }
    assert!(machine.output.flight_status.armed, "where the stick is a climb rate, it does");
}

#[test]
fn a_click_takes_off_and_holds_the_place() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    machine.wanted = FlightMode::Stabilize;
    let clicked = press(&mut world, &mut machine, Duration::ZERO, ButtonGesture::Click);
    assert_eq!((clicked.phase, clicked.mode), (FlightPhase::Armed, FlightMode::PosHold));
    world.now += ModeConfig::default().spool;
    let later = world.step(&mut machine, &[]).flight_status;
    assert_eq!((later.phase, later.mode), (FlightPhase::TakeOff, FlightMode::PosHold));
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
fn modes_fall_back_to_what_is_known() {
    let (mut machine, mut world) = in_phase(FlightPhase::Flying);
    assert_eq!(machine.output.flight_status.mode, FlightMode::PosHold);
    world.estimate.valid = Validity::ALL.without(Validity::VELOCITY_XY);
    assert_eq!(world.step(&mut machine, &[]).flight_status.mode, FlightMode::AltHold);
    world.estimate.valid = Validity::TILT;
    assert_eq!(world.step(&mut machine, &[]).flight_status.mode, FlightMode::Stabilize);
}

#[test]
fn a_crash_has_to_be_acknowledged() {
    let (mut machine, mut world) = in_phase(FlightPhase::Flying);
    world.alerts = Alerts::IMPACT;
    world.step(&mut machine, &[]);
    world.alerts = Alerts::NONE;
    assert!(!world.step(&mut machine, &[Command::Arm]).flight_status.armed);
    world.step(&mut machine, &[Command::Disarm]);
    assert!(world.step(&mut machine, &[Command::Arm]).flight_status.armed);
}
