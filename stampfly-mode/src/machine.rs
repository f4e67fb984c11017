//! The mode machine: the only place where the vehicle changes phase, mode and commander.
//!
//! [`ModeMachine::step`] turns its inputs into [`Facts`] (switches debounced, sticks cleaned, gestures told apart) and lets
//! [`decide`](crate::decision::decide) say what follows. The failsafe is an event, never a phase.

use crate::arming::{Refusal, Refusals};
use crate::config::ModeConfig;
use crate::decision::{State, advance, flip_blocks};
use crate::facts::Facts;
pub use crate::input::{Command, ModeInput};
use crate::pilot::Transmitter;
use crate::stop_button::StopButton;
use crate::transitions::is_airborne;
use stampfly_types::Instant;
use stampfly_types::messages::{
    Alerts, ArmBlocks, ButtonGesture, CommandSource, EstimatorCommand, FlightPhase, FlightStatus,
};

/// What the machine decides.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ModeOutput {
    /// State, mode, armed.
    pub flight_status: FlightStatus,
    /// What the estimator is to do.
    pub estimator: EstimatorCommand,
    /// Arming was asked for in this step and refused; [`ModeMachine::refusals`] says why. A click of the button is also refused when
    /// something blocked arming as it was pressed.
    pub refused: bool,
}

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
///     pilot: None, sticks: CommandSource::None, commands: &[], button: None,
///     cut_off: false,
/// };
/// assert_eq!(machine.step(Instant::ZERO, &input).flight_status.phase, FlightPhase::IdleGround);
/// input.commands = &[GuidedKind::Arm, GuidedKind::Kill];
/// assert!(!machine.step(Instant::from_micros(2_500), &input).flight_status.armed, "in any order, a kill wins");
/// input.commands = &[GuidedKind::Arm];
/// assert!(machine.step(Instant::from_micros(5_000), &input).flight_status.armed);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ModeMachine {
    config: ModeConfig,
    state: State,
    transmitter: Transmitter,
    stop_button: StopButton,
    /// Something blocked arming when the button was pressed.
    blocked_when_pressed: bool,
    refusals: Refusals,
}

impl ModeMachine {
    /// The machine of a vehicle that has just been switched on.
    #[must_use]
    pub fn new(config: ModeConfig) -> Self {
        Self { config, ..Self::default() }
    }

    /// All it remembers.
    #[must_use]
    pub const fn state(&self) -> &State {
        &self.state
    }

    /// Why arming would have been refused in the step before, the weightiest reason first; empty when it would not.
    pub fn refusals(&self) -> impl Iterator<Item = Refusal> {
        self.refusals.iter()
    }

    /// Frames of the pilot with a stick that was no number.
    #[must_use]
    pub const fn unreadable_frames(&self) -> u32 {
        self.transmitter.unreadable()
    }

    /// One step, at the control rate.
    pub fn step(&mut self, now: Instant, input: &ModeInput<'_>) -> ModeOutput {
        let armed = self.state.is_armed();
        let flies = self.state.commander == CommandSource::Pilot;
        let pilot = self.transmitter.step(&self.config, input.pilot, armed, flies);
        // The button is on the vehicle: a gesture on an armed one means that it is held in a hand.
        let stop_button = self.stop_button.stops(now, self.config.button_release, input.button, armed);
        let button = self.stop_button.unused(input.button);
        let mut facts = Facts::read(now, input, pilot, armed, stop_button, button);
        // A click is known half a second after the button was let go. Whoever pressed it saw a vehicle that would not arm, and has perhaps
        // taken hold of it when a transmitter comes on meanwhile.
        facts.click_is_void = self.blocked_when_pressed;

        let State { phase, unacknowledged, pairing, .. } = self.state;
        advance(&self.config, &mut self.state, &facts);
        let state = &self.state;
        if state.pairing.is_some() != pairing.is_some() {
            // Another transmitter has to show its arm switch off, too.
            self.transmitter.forget();
        }
        let blocks = if armed {
            // There is nothing to arm, and the checks would be half of a step. All of them passed when it was armed, so none of
            // their refusals is left.
            ArmBlocks::NOT_ON_GROUND
        } else {
            // The checks of this decision: before what it acknowledged and where it led.
            let checked = State { phase, unacknowledged, ..*state };
            self.refusals.step(&self.config, &checked, &facts);
            self.refusals.iter().fold(ArmBlocks::NONE, |blocks, refusal| blocks | refusal.check)
        };
        if input.button == Some(ButtonGesture::Press) {
            self.blocked_when_pressed = blocks != ArmBlocks::NONE;
        }
        // A landing makes its own thrust, in every mode.
        let lands = state.phase == FlightPhase::Landing;
        let is_thrust = state.mode.is_manual() && state.commander == CommandSource::Pilot && !lands;
        let rests = is_thrust && facts.throttle_rests(&self.config);
        let asked = facts.asked.arm || facts.pilot.switch.rises || button == Some(ButtonGesture::Click);
        ModeOutput {
            flight_status: FlightStatus {
                phase: state.phase,
                mode: state.mode,
                armed: state.is_armed(),
                commander: state.commander,
                pairing: state.pairing.is_some(),
                blocks,
                flip_blocks: flip_blocks(&self.config, state, &facts),
                transitions: state.transitions,
                control_resets: state.control_resets,
            },
            estimator: EstimatorCommand {
                on_ground: matches!(state.phase, FlightPhase::IdleGround | FlightPhase::Armed),
                flying: is_airborne(state.phase) && !rests,
                accel_faulty: facts.alerts.contains(Alerts::ACCEL_FAULTY),
                origin_resets: state.origin_resets,
                full_resets: state.full_resets,
            },
            refused: asked && !armed && !state.is_armed(),
        }
    }
}

#[cfg(test)]
mod tests;
