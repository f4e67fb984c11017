//! The machine from outside, step by step: phases, events, switches, the button, crashes, silence.

use super::*;
use stampfly_types::Duration;
use stampfly_types::messages::{
    Alerts, CalibrationResult, FlightMode, GroundContact, GuidedKind, LandDetected, PilotInput, StateEstimate, Validity,
};

/// Range, flow and barometer.
const SENSORS_LOST: Alerts = Alerts::TOF_LOST.with(Alerts::FLOW_LOST).with(Alerts::BARO_LOST);
const STEP: Duration = Duration::from_micros(2_500);

/// A situation the machine can be put into.
#[derive(Clone)]
pub(crate) struct World {
    pub estimate: StateEstimate,
    pub calibration: CalibrationResult,
    pub land_detected: LandDetected,
    pub alerts: Alerts,
    /// Sends a frame every 20 ms.
    pub pilot: Option<PilotInput>,
    /// What the controllers follow; `None` for the commander's sticks, at once.
    pub sticks: Option<CommandSource>,
    /// Happens in the next step, and not again.
    pub button: Option<ButtonGesture>,
    pub cut_off: bool,
    pub now: Instant,
}

impl World {
    pub fn ready() -> Self {
        Self {
            estimate: StateEstimate { height: 0.03, valid: Validity::ALL, ..Default::default() },
            calibration: CalibrationResult { complete: true, ..Default::default() },
            land_detected: LandDetected::default(),
            alerts: Alerts::NONE,
            pilot: None,
            sticks: None,
            button: None,
            cut_off: false,
            now: Instant::ZERO,
        }
    }

    pub fn step(&mut self, machine: &mut ModeMachine, commands: &[Command]) -> ModeOutput {
        self.now += STEP;
        let frame_at = Instant::from_micros(self.now.as_micros() / 20_000 * 20_000);
        let input = ModeInput {
            alerts: self.alerts,
            estimate: &self.estimate,
            calibration: &self.calibration,
            land_detected: &self.land_detected,
            pilot: self.pilot.as_ref().map(|pilot| (frame_at, pilot)),
            sticks: self.sticks.unwrap_or(machine.state.commander),
            commands,
            button: self.button.take(),
            cut_off: self.cut_off,
        };
        machine.step(self.now, &input)
    }

    /// Lets this time pass, and returns the last decision.
    pub fn pass(&mut self, machine: &mut ModeMachine, millis: u64) -> FlightStatus {
        let end = self.now + Duration::from_millis(millis);
        let mut status = self.step(machine, &[]).flight_status;
        while self.now < end {
            status = self.step(machine, &[]).flight_status;
        }
        status
    }

    /// The pilot sends this for long enough to be believed.
    pub fn sends(&mut self, machine: &mut ModeMachine, pilot: PilotInput) -> FlightStatus {
        self.pilot = Some(pilot);
        self.pass(machine, 120)
    }

    /// The vehicle is in the air, so high.
    pub fn fly_at(&mut self, height: f32) {
        self.estimate.height = height;
        self.land_detected.contact = GroundContact::Air;
    }
}

/// A phase reached by program, in a vehicle that flies at 1.5 m.
pub(crate) fn in_phase(phase: FlightPhase) -> (ModeMachine, World) {
    let (mut machine, mut world) = (ModeMachine::default(), World::ready());
    for command in [Command::None, Command::Arm, Command::TakeOff, Command::None, Command::Land] {
        if machine.state.phase == phase {
            break;
        }
        if machine.state.phase == FlightPhase::TakeOff {
            world.fly_at(1.5);
            world.land_detected.takeoff_complete = true;
        }
        world.step(&mut machine, &[command]);
    }
    world.land_detected.takeoff_complete = false;
    if phase == FlightPhase::IdleHeld {
        (machine, world) = in_phase(FlightPhase::IdleGround);
        world.estimate.height = 0.5;
        world.step(&mut machine, &[]);
    }
    assert_eq!(machine.state.phase, phase);
    (machine, world)
}

fn frame(mode: FlightMode, arm: bool, throttle: f32) -> PilotInput {
    PilotInput { mode, arm, throttle, ..Default::default() }
}

/// The pilot has armed by switch and flies at 1.5 m in this mode.
fn piloted(mode: FlightMode) -> (ModeMachine, World) {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    world.sends(&mut machine, frame(mode, false, 0.0));
    assert!(world.sends(&mut machine, frame(mode, true, 0.0)).armed);
    world.sends(&mut machine, frame(mode, true, 0.3));
    world.pass(&mut machine, 300);
    world.fly_at(1.5);
    world.land_detected.takeoff_complete = true;
    let status = world.pass(&mut machine, 10);
    assert_eq!((status.phase, status.mode, status.commander), (FlightPhase::Flying, mode, CommandSource::Pilot));
    world.land_detected.takeoff_complete = false;
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
fn d4_a_pilot_lost_in_a_manual_mode_is_replaced_by_a_hold_and_a_landing() {
    for mode in [FlightMode::Stabilize, FlightMode::Acro] {
        for (valid, expected) in
            [(Validity::ALL, FlightMode::PosHold), (Validity::ALL.without(Validity::VELOCITY_XY), FlightMode::AltHold)]
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
    assert_eq!(world.sends(&mut machine, sent).mode, FlightMode::Stabilize);
}

#[test]
fn d14_sticks_that_do_not_arrive_on_board_end_a_manual_mode() {
    let (mut machine, mut world) = piloted(FlightMode::Stabilize);
    world.sticks = Some(CommandSource::Failsafe);
    let status = world.step(&mut machine, &[]).flight_status;
    assert_eq!((status.phase, status.mode), (FlightPhase::Flying, FlightMode::PosHold));
}

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
    let parked = frame(FlightMode::Stabilize, false, 0.0);
    for (acts, mode) in [
        (PilotInput { roll: 0.4, ..parked }, FlightMode::PosHold),
        (PilotInput { mode: FlightMode::AltHold, ..parked }, FlightMode::AltHold),
        (PilotInput { mode: FlightMode::Acro, ..parked }, FlightMode::Acro),
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
        let expected = if mode.is_manual() { CommandSource::Pilot } else { CommandSource::Guided };
        assert_eq!(machine.state.commander, expected, "no program takes over a manual flight");
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
    assert_eq!(world.step(&mut machine, &[]).flight_status.mode, FlightMode::Stabilize);
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
fn d16_pairing_ends_when_the_new_transmitter_talks_though_it_always_did() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    world.sends(&mut machine, frame(FlightMode::PosHold, false, 0.0));
    world.button = Some(ButtonGesture::HoldPair);
    assert!(world.step(&mut machine, &[]).flight_status.pairing);
    assert!(world.pass(&mut machine, 100).pairing, "a frame from before is still fresh");
    world.alerts = Alerts::COMM_LOST;
    assert_eq!(machine.refusals().map(|refusal| refusal.check).next(), Some(ArmBlocks::PAIRING));
    assert!(!world.pass(&mut machine, 200).pairing);
}

#[test]
fn d16_pairing_ends_by_itself_and_by_the_button() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    for again in [false, true] {
        world.button = Some(ButtonGesture::HoldPair);
        assert!(world.step(&mut machine, &[]).flight_status.pairing);
        if again {
            world.button = Some(ButtonGesture::HoldPair);
            assert!(!world.step(&mut machine, &[]).flight_status.pairing);
        } else {
            assert!(world.pass(&mut machine, 59_900).pairing);
            assert!(!world.pass(&mut machine, 200).pairing);
        }
    }
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
fn d17_a_lifted_vehicle_that_does_not_know_its_height_stands_again() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleHeld);
    let resets = machine.state.full_resets;
    world.estimate.valid = Validity::NONE;
    assert_eq!(world.pass(&mut machine, 1_900).phase, FlightPhase::IdleHeld);
    assert_eq!(world.pass(&mut machine, 200).phase, FlightPhase::IdleGround);
    assert_eq!(machine.state.full_resets, resets + 1, "and the estimator begins anew");
}

#[test]
fn d17_take_off_and_landing_end_by_themselves() {
    let (mut machine, mut world) = in_phase(FlightPhase::TakeOff);
    assert_eq!(world.pass(&mut machine, 14_900).phase, FlightPhase::TakeOff);
    assert_eq!(world.pass(&mut machine, 200).phase, FlightPhase::Landing);
    for (valid, seconds) in [(Validity::ALL, 40), (Validity::TILT, 60)] {
        let (mut machine, mut world) = in_phase(FlightPhase::Flying);
        world.estimate.valid = valid;
        world.step(&mut machine, &[Command::Land]);
        assert_eq!(world.pass(&mut machine, seconds * 1_000 - 100).phase, FlightPhase::Landing);
        let status = world.pass(&mut machine, 300);
        assert!(!status.armed && status.blocks.contains(ArmBlocks::CRASHED));
    }
}

#[test]
fn d20_a_throttle_that_is_no_number_does_not_take_off() {
    for bad in [f32::INFINITY, f32::NAN] {
        let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
        world.sends(&mut machine, frame(FlightMode::Stabilize, false, bad));
        assert!(world.sends(&mut machine, frame(FlightMode::Stabilize, true, bad)).armed);
        assert_eq!(world.pass(&mut machine, 1_000).phase, FlightPhase::Armed);
        assert!(machine.unreadable_frames() > 50);
    }
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
    let (mut machine, mut world) = in_phase(FlightPhase::Flying);
    world.alerts = Alerts::IMPACT;
    world.step(&mut machine, &[]);
    world.alerts = Alerts::NONE;
    world.estimate.height = 0.03;
    let millis = Duration::from_millis;
    press(&mut world, &mut machine, millis(5_000), ButtonGesture::Press);
    assert_eq!(world.step(&mut machine, &[]).flight_status.blocks, ArmBlocks::CRASHED, "not yet");
    assert!(!press(&mut world, &mut machine, millis(500), ButtonGesture::Click).armed);
    assert_eq!(world.step(&mut machine, &[]).flight_status.blocks, ArmBlocks::NONE);
    press(&mut world, &mut machine, millis(500), ButtonGesture::Press);
    assert!(press(&mut world, &mut machine, millis(500), ButtonGesture::Click).armed, "the next press does");
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
fn a_click_takes_off_and_holds_the_place() {
    let (mut machine, mut world) = in_phase(FlightPhase::IdleGround);
    world.sends(&mut machine, frame(FlightMode::Stabilize, false, 0.0));
    let clicked = press(&mut world, &mut machine, Duration::ZERO, ButtonGesture::Click);
    assert_eq!((clicked.phase, clicked.mode), (FlightPhase::Armed, FlightMode::PosHold));
    let later = world.pass(&mut machine, 310);
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
fn a_crash_has_to_be_acknowledged() {
    let (mut machine, mut world) = in_phase(FlightPhase::Flying);
    world.alerts = Alerts::IMPACT;
    world.step(&mut machine, &[]);
    world.alerts = Alerts::NONE;
    world.estimate.height = 0.03;
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
