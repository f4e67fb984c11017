//! The mode machine: the only place where the vehicle changes phase.
//!
//! [`ModeMachine::step`] finds out which events have happened, most urgent first, takes at most one transition of the
//! [table](crate::transitions) a step, and runs what leaving and entering a phase means (resets of controller and
//! estimator). The failsafe is an event, never a phase.

use crate::arming;
pub use crate::input::{Command, ModeInput};
use crate::stop_button::StopButton;
use crate::transitions::{Event, is_armed, next};
use stampfly_types::messages::{
    Alerts, ButtonGesture, EstimatorCommand, FlightMode, FlightPhase, FlightStatus, GroundContact, Validity,
};
use stampfly_types::{Duration, Instant};

/// What the machine decides.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ModeOutput {
    /// State, mode, armed.
    pub flight_status: FlightStatus,
    /// What the estimator is to do.
    pub estimator: EstimatorCommand,
}

/// Alerts that stop the motors in any phase.
const CUT: Alerts = Alerts::IMPACT.with(Alerts::GYRO_ANOMALY).with(Alerts::TUMBLED).with(Alerts::IMU_LOST);
/// Alerts that demand a landing at once.
const LAND: Alerts = Alerts::CRITICAL_BATTERY.with(Alerts::ESTIMATE_DIVERGED);
/// How long the vehicle hovers without a link before it lands.
const HOVER_WITHOUT_LINK: Duration = Duration::from_secs(3);
/// Time between arming and take-off when the pilot's mode takes off by itself.
const SPOOL: Duration = Duration::from_millis(300);
/// An armed vehicle that is not told to take off is disarmed after this long.
const ARMED_TIMEOUT: Duration = Duration::from_secs(10);
/// Height above the ground that means somebody has lifted the vehicle, m, and below which it stands again.
const HELD_HEIGHT: [f32; 2] = [0.15, 0.08];
/// Manual throttle that takes off.
const THROTTLE_TAKE_OFF: f32 = 0.1;

/// The mode machine.
///
/// ```
/// use stampfly_mode::{ModeInput, ModeMachine};
/// use stampfly_types::{Instant, messages::*};
/// let mut machine = ModeMachine::default();
/// let estimate = StateEstimate { height: 0.03, valid: Validity::ALL, ..Default::default() };
/// let calibration = CalibrationResult { complete: true, ..Default::default() };
/// let land_detected = LandDetected::default();
/// let mut input = ModeInput {
///     alerts: Alerts::NONE, estimate: &estimate, calibration: &calibration, land_detected: &land_detected,
///     pilot: None, commands: &[], button: None,
/// };
/// assert_eq!(machine.step(Instant::ZERO, &input).flight_status.phase, FlightPhase::IdleGround);
/// input.commands = &[GuidedKind::Arm];
/// assert!(machine.step(Instant::from_micros(2_500), &input).flight_status.armed);
/// input.commands = &[GuidedKind::Kill];
/// assert!(!machine.step(Instant::from_micros(5_000), &input).flight_status.armed);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ModeMachine {
    output: ModeOutput,
    entered: Instant,
    /// The mode asked for; the one in force may be a fallback.
    wanted: FlightMode,
    /// Arm switch of the pilot's last frame; `None` until it has been seen off.
    switch: Option<bool>,
    /// Armed by pilot or button, which take off by themselves in modes that hold height.
    takes_off: bool,
    crashed: bool,
    silent_since: Option<Instant>,
    was_diverged: bool,
    stop_button: StopButton,
    /// While pairing: has the transmitter of before fallen silent?
    unheard: bool,
}

impl ModeMachine {
    /// One step, at the control rate.
    pub fn step(&mut self, now: Instant, input: &ModeInput<'_>) -> ModeOutput {
        let switch = self.pilot_switch(input);
        // The button is on the vehicle: a gesture on an armed one means that it is held in a hand.
        let stopped_by_button = self.stop_button.stops(now, input.button, is_armed(self.output.flight_status.phase));
        let input = &ModeInput { button: self.stop_button.unused(input.button), ..*input };
        self.choose_mode(input);
        let mode = &mut self.output.flight_status;
        if input.button == Some(ButtonGesture::HoldPair) {
            mode.pairing = !mode.pairing;
            self.unheard = false;
            // Another transmitter has to show its arm switch off, too.
            self.switch = None;
        }
        // The first frame after silence is the new transmitter's: the link listens to no other.
        if mode.pairing && input.pilot.is_some() && self.unheard {
            mode.pairing = false;
        }
        self.unheard = mode.pairing && (self.unheard || input.pilot.is_none());
        mode.blocks = arming::blocks(mode, self.crashed, switch.is_stale, input);
        let happened = self.happened(now, input, &switch, stopped_by_button);
        if self.acknowledges(input, &switch) {
            self.crashed = false;
        }
        let holds_height = matches!(self.output.flight_status.mode, FlightMode::AltHold | FlightMode::PosHold);
        let transition = Event::ALL.into_iter().zip(happened).filter(|(_, happened)| *happened);
        if let Some((event, phase)) = transition
            .filter_map(|(event, _)| {
                next(self.output.flight_status.phase, event, holds_height).map(|phase| (event, phase))
            })
            .next()
        {
            self.leave_and_enter(now, event, phase, input);
        }
        if input.alerts.contains(Alerts::ESTIMATE_DIVERGED) && !self.was_diverged {
            self.output.estimator.full_resets = self.output.estimator.full_resets.wrapping_add(1);
        }
        self.was_diverged = input.alerts.contains(Alerts::ESTIMATE_DIVERGED);
        self.output
    }

    /// Which of [`Event::ALL`] have happened, in the same order.
    fn happened(
        &mut self,
        now: Instant,
        input: &ModeInput<'_>,
        switch: &Switch,
        stopped_by_button: bool,
    ) -> [bool; 10] {
        let mode = &self.output.flight_status;
        let commanded = |kind: Command| input.commands.contains(&kind);
        let clicked = input.button == Some(ButtonGesture::Click);
        let armed = is_armed(mode.phase);
        let height_known = input.estimate.valid.contains(Validity::HEIGHT);
        let [held, standing] = HELD_HEIGHT;

        if input.alerts.contains(Alerts::COMM_LOST) && armed {
            self.silent_since.get_or_insert(now);
        } else {
            self.silent_since = None;
        }
        let abandoned = self.silent_since.is_some_and(|since| now.since(since) >= HOVER_WITHOUT_LINK);
        let waited = now.since(self.entered);
        let manual = matches!(mode.mode, FlightMode::Acro | FlightMode::Stabilize);
        let throttle_up = input.pilot.is_some_and(|pilot| pilot.throttle > THROTTLE_TAKE_OFF);
        let lifts_off = if manual { throttle_up } else { self.takes_off && waited >= SPOOL };
        let airborne_by_hand = manual && input.land_detected.contact == GroundContact::Air;
        [
            input.alerts.intersects(CUT)
                || commanded(Command::Kill)
                || stopped_by_button
                || input.pilot.is_some_and(|pilot| pilot.kill),
            commanded(Command::Disarm) || switch.falls || (mode.phase == FlightPhase::Armed && waited >= ARMED_TIMEOUT),
            input.land_detected.landed,
            commanded(Command::Land) || abandoned || input.alerts.intersects(LAND),
            input.land_detected.takeoff_complete || airborne_by_hand,
            commanded(Command::TakeOff) || lifts_off,
            (commanded(Command::Arm) || switch.rises || clicked) && mode.blocks.is_empty(),
            height_known && input.estimate.height < standing,
            height_known && input.estimate.height > held,
            input.calibration.complete && input.estimate.valid.contains(Validity::TILT),
        ]
    }

    /// Callbacks of leaving one phase and entering another, in one place.
    fn leave_and_enter(&mut self, now: Instant, event: Event, phase: FlightPhase, input: &ModeInput<'_>) {
        let ModeOutput { flight_status: mode, estimator } = &mut self.output;
        let left = mode.phase;
        mode.phase = phase;
        mode.armed = is_armed(phase);
        mode.transitions = mode.transitions.wrapping_add(1);
        self.entered = now;
        match phase {
            FlightPhase::IdleGround => {
                mode.control_resets = mode.control_resets.wrapping_add(1);
                if left == FlightPhase::IdleHeld {
                    estimator.full_resets = estimator.full_resets.wrapping_add(1);
                }
                self.crashed |= event == Event::Emergency && input.alerts.intersects(CUT);
            }
            FlightPhase::Armed => {
                mode.control_resets = mode.control_resets.wrapping_add(1);
                // Positions count from the take-off spot.
                estimator.origin_resets = estimator.origin_resets.wrapping_add(1);
                self.takes_off = !input.commands.contains(&Command::Arm);
            }
            FlightPhase::Init
            | FlightPhase::IdleHeld
            | FlightPhase::TakeOff
            | FlightPhase::Flying
            | FlightPhase::Landing => {}
        }
        estimator.on_ground = matches!(phase, FlightPhase::IdleGround | FlightPhase::Armed);
    }

    /// The mode in force: the one asked for, or the best one the estimate allows.
    fn choose_mode(&mut self, input: &ModeInput<'_>) {
        if let Some(pilot) = input.pilot {
            self.wanted = pilot.mode;
        } else if input.commands.iter().any(|command| *command != Command::None)
            || input.button == Some(ButtonGesture::Click)
        {
            // Programs and the button have no sticks: the vehicle holds its place by itself.
            self.wanted = FlightMode::PosHold;
        }
        let valid = input.estimate.valid;
        let height = valid.contains(Validity::VELOCITY_Z);
        let place = height && valid.contains(Validity::VELOCITY_XY);
        self.output.flight_status.mode = match self.wanted {
            FlightMode::PosHold if place => FlightMode::PosHold,
            FlightMode::PosHold | FlightMode::AltHold if height => FlightMode::AltHold,
            FlightMode::PosHold | FlightMode::AltHold | FlightMode::Stabilize => FlightMode::Stabilize,
            FlightMode::Acro => FlightMode::Acro,
        };
    }

    fn pilot_switch(&mut self, input: &ModeInput<'_>) -> Switch {
        let Some(pilot) = input.pilot else {
            // Whatever the switch does meanwhile, nobody sees it: it has to be seen off again before it arms.
            if !is_armed(self.output.flight_status.phase) {
                self.switch = None;
            }
            return Switch::default();
        };
        let before = self.switch;
        if before.is_some() || !pilot.arm {
            self.switch = Some(pilot.arm);
        }
        Switch {
            rises: before == Some(false) && pilot.arm,
            falls: before == Some(true) && !pilot.arm,
            is_stale: before.is_none() && pilot.arm,
        }
    }

    /// Somebody has come to look at a crashed vehicle.
    fn acknowledges(&self, input: &ModeInput<'_>, switch: &Switch) -> bool {
        let idle = !is_armed(self.output.flight_status.phase);
        // A press alone is none: what it becomes may be a click, which must not find the crash acknowledged and arm.
        let gesture = input.button.is_some_and(|gesture| gesture != ButtonGesture::Press);
        idle && (switch.falls || gesture || input.commands.contains(&Command::Disarm))
    }
}

/// What the pilot's arm switch did.
#[derive(Clone, Copy, Debug, Default)]
struct Switch {
    rises: bool,
    falls: bool,
    is_stale: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::messages::ArmBlocks;
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
        world.now += SPOOL;
        let later = world.step(&mut machine, &[]).flight_status;
        assert_eq!((later.phase, later.mode), (FlightPhase::TakeOff, FlightMode::PosHold));
    }

    #[test]
    fn a_lost_link_hovers_then_lands() {
        let (mut machine, mut world) = in_phase(FlightPhase::Flying);
        world.alerts = Alerts::COMM_LOST;
        let landed_after =
            (0..2_000).find(|_| world.step(&mut machine, &[]).flight_status.phase == FlightPhase::Landing);
        assert_eq!(landed_after, Some(1_200), "3 s at 400 Hz");
        world.alerts = Alerts::NONE;
        assert_eq!(
            world.step(&mut machine, &[]).flight_status.phase,
            FlightPhase::Landing,
            "a link that returns is no reason to stop"
        );
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
}
