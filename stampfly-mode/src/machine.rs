//! The mode machine: the only place where the vehicle changes phase.
//!
//! [`ModeMachine::step`] finds out which events have happened, most urgent first, takes at most one transition of the
//! [table](crate::transitions) a step, and runs what leaving and entering a phase means (resets of controller and
//! estimator). The failsafe is an event, never a phase.

use crate::arm_switch::{ArmSwitch, Switched};
use crate::arming;
use crate::config::ModeConfig;
pub use crate::input::{Command, ModeInput};
use crate::stop_button::StopButton;
use crate::transitions::{Event, is_armed, next};
use stampfly_types::Instant;
use stampfly_types::messages::{
    Alerts, ButtonGesture, EstimatorCommand, FlightMode, FlightPhase, FlightStatus, GroundContact, Validity,
};

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
const CUT: Alerts =
    Alerts::IMPACT.with(Alerts::GYRO_ANOMALY).with(Alerts::TUMBLED).with(Alerts::IMU_LOST).with(Alerts::IMU_FAULTY);
/// Alerts that demand a landing at once.
const LAND: Alerts = Alerts::CRITICAL_BATTERY.with(Alerts::ESTIMATE_DIVERGED);

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
    config: ModeConfig,
    output: ModeOutput,
    entered: Instant,
    /// The mode asked for; the one in force may be a fallback.
    wanted: FlightMode,
    arm_switch: ArmSwitch,
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
    /// The machine of a vehicle that has just been switched on.
    #[must_use]
    pub fn new(config: ModeConfig) -> Self {
        Self { config, ..Self::default() }
    }

    /// One step, at the control rate.
    pub fn step(&mut self, now: Instant, input: &ModeInput<'_>) -> ModeOutput {
        let switch = self.arm_switch.step(input.pilot, is_armed(self.output.flight_status.phase));
        // The button is on the vehicle: a gesture on an armed one means that it is held in a hand.
        let armed = is_armed(self.output.flight_status.phase);
        let stopped_by_button = self.stop_button.stops(now, self.config.button_release, input.button, armed);
        let input = &ModeInput { button: self.stop_button.unused(input.button), ..*input };
        self.choose_mode(input);
        let mode = &mut self.output.flight_status;
        if input.button == Some(ButtonGesture::HoldPair) {
            mode.pairing = !mode.pairing;
            self.unheard = false;
            // Another transmitter has to show its arm switch off, too.
            self.arm_switch.forget();
        }
        // The first frame after silence is the new transmitter's: the link listens to no other.
        if mode.pairing && input.pilot.is_some() && self.unheard {
            mode.pairing = false;
        }
        self.unheard = mode.pairing && (self.unheard || input.pilot.is_none());
        mode.blocks = arming::blocks(&self.config, mode, self.crashed, switch.is_stale, input);
        let happened = self.happened(now, input, &switch, stopped_by_button);
        if self.acknowledges(input, &switch) {
            self.crashed = false;
        }
        let holds_height = !self.output.flight_status.mode.is_manual();
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
        switch: &Switched,
        stopped_by_button: bool,
    ) -> [bool; 10] {
        let (config, mode) = (&self.config, &self.output.flight_status);
        let commanded = |kind: Command| input.commands.contains(&kind);
        let clicked = input.button == Some(ButtonGesture::Click);
        let armed = is_armed(mode.phase);
        let height_known = input.estimate.valid.contains(Validity::HEIGHT);

        if input.alerts.contains(Alerts::COMM_LOST) && armed {
            self.silent_since.get_or_insert(now);
        } else {
            self.silent_since = None;
        }
        let abandoned = self.silent_since.is_some_and(|since| now.since(since) >= config.hover_without_link);
        let waited = now.since(self.entered);
        let manual = mode.mode.is_manual();
        let throttle_up = input.pilot.is_some_and(|pilot| pilot.throttle > config.throttle_take_off);
        let lifts_off = if manual { throttle_up } else { self.takes_off && waited >= config.spool };
        let airborne_by_hand = manual && input.land_detected.contact == GroundContact::Air;
        [
            input.alerts.intersects(CUT)
                || commanded(Command::Kill)
                || stopped_by_button
                || input.pilot.is_some_and(|pilot| pilot.kill),
            commanded(Command::Disarm)
                || switch.falls
                || (mode.phase == FlightPhase::Armed && waited >= config.armed_timeout),
            input.land_detected.landed,
            commanded(Command::Land) || abandoned || input.alerts.intersects(LAND),
            input.land_detected.takeoff_complete || airborne_by_hand,
            commanded(Command::TakeOff) || lifts_off,
            (commanded(Command::Arm) || switch.rises || clicked) && mode.blocks.is_empty(),
            height_known && input.estimate.height < config.standing_height,
            height_known && input.estimate.height > config.held_height,
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

    /// Somebody has come to look at a crashed vehicle.
    fn acknowledges(&self, input: &ModeInput<'_>, switch: &Switched) -> bool {
        let idle = !is_armed(self.output.flight_status.phase);
        // A press alone is none: what it becomes may be a click, which must not find the crash acknowledged and arm.
        let gesture = input.button.is_some_and(|gesture| gesture != ButtonGesture::Press);
        idle && (switch.falls || gesture || input.commands.contains(&Command::Disarm))
    }
}

#[cfg(test)]
mod tests;
