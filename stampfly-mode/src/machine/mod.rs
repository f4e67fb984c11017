//! The one place that decides about states.
//!
//! Each step the machine turns its inputs into a set of [`Event`]s, asks the [table](next) about the most urgent ones and
//! makes at most one transition. Leaving and entering a state have their actions (resets of controller and estimator),
//! which is why nobody else needs to watch for transitions.
//!
//! # Decisions worth knowing
//! * **Arming** needs an edge: the switch must have been seen off. A switch that is on at power-on, or that was on during
//!   a crash, does nothing until it has been off.
//! * **Taking off by itself** after a short spool-up happens only when the pilot's *switch* armed the vehicle in a mode
//!   that holds height. A button is pressed by a finger right beside the propellers, and a program says when it wants to
//!   take off, so both wait for a guided take-off or for the throttle to be raised.
//! * **A lost link** in a mode that holds height hovers for three seconds (the navigator holds the place), then lands.
//!   With direct thrust there is nothing to hover with: landing begins at once. Coming back does not cancel a landing.
//! * **A mode that cannot be flown** is replaced by the next simpler one, from position hold to altitude hold at most
//!   while in the air: dropping from height control to a throttle stick at rest would drop the vehicle. When the vertical
//!   outputs go, it lands.
//! * **After a crash** nothing arms until the operator has acknowledged: switch off, button click, or guided disarm.

mod table;

use stampfly_types::Micros;
use stampfly_types::messages::{
    Alerts, ArmBlocks, ButtonGesture, CalibrationResult, CommandSetpoint, CommandSource, EstimatorCommand, FlightMode,
    FlightState, GroundContact, GuidedCommand, GuidedKind, PilotInput, StateEstimate, SystemAlert, SystemMode,
    Validity, VehicleStatus,
};

pub use table::{Decision, Event, Facts, armed, next};

use crate::arming::{self, ArmingFacts, holds_height, serves};
use crate::persist::Persist;
use table::Events;

/// Times of the [`ModeMachine`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModeConfig {
    /// Between arming and taking off.
    pub spool: Micros,
    /// Hover after the link is lost.
    pub link_grace: Micros,
    /// A program flies without being able to hold the place for at most this long.
    pub guidance_grace: Micros,
    /// Standing armed for longer than this disarms.
    pub armed_timeout: Micros,
    /// A take-off that has not left the ground after this long is given up.
    pub take_off_timeout: Micros,
    /// A change of what can be flown must hold for this long before the mode follows in flight.
    pub mode_settle: Micros,
    /// Outputs of the estimator must be gone for this long before the vehicle lands without them.
    pub estimate_grace: Micros,
    /// Throttle that takes off when the vehicle was not armed by the switch, 0 to 1.
    pub throttle_take_off: f32,
}

impl Default for ModeConfig {
    fn default() -> Self {
        Self {
            spool: Micros::from_millis(300),
            link_grace: Micros::from_secs(3),
            guidance_grace: Micros::from_secs(3),
            armed_timeout: Micros::from_secs(30),
            take_off_timeout: Micros::from_secs(5),
            mode_settle: Micros::from_secs(1),
            estimate_grace: Micros::from_millis(500),
            throttle_take_off: 0.5,
        }
    }
}

/// All the machine looks at in one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModeInput<'a> {
    /// What the failsafe has found in this period.
    pub alert: &'a SystemAlert,
    /// The state estimate.
    pub estimate: &'a StateEstimate,
    /// The still-calibration.
    pub calibration: &'a CalibrationResult,
    /// Contact, take-off and landing.
    pub status: &'a VehicleStatus,
    /// The arbitrated command.
    pub command: &'a CommandSetpoint,
    /// The pilot's newest frame, as long as the link is alive.
    pub pilot: Option<&'a PilotInput>,
    /// Guided commands that arrived since the previous step, in order.
    pub guided: &'a [GuidedCommand],
    /// What the button did since the previous step.
    pub button: ButtonGesture,
    /// A transmitter has been paired since the previous step.
    pub paired: bool,
}

/// What the machine decides.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ModeOutput {
    /// State, mode, may the motors turn.
    pub mode: SystemMode,
    /// What the estimator has to know about it.
    pub estimator: EstimatorCommand,
}

/// A transition that was made, for the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transition {
    /// When.
    pub at: Micros,
    /// From.
    pub from: FlightState,
    /// To.
    pub to: FlightState,
    /// Why.
    pub event: Event,
}

/// Who armed the vehicle: decides how it takes off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Armer {
    Switch,
    Button,
    Program,
}

/// What people and programs asked for in one step.
#[derive(Default)]
struct Asked {
    events: Events,
    armer: Option<Armer>,
    /// A take-off came in the same batch as the arming before it.
    take_off: bool,
    /// Somebody wants another mode.
    mode: bool,
}

impl Asked {
    fn arm(&mut self, armer: Armer) {
        self.events.note(Event::Arm, true);
        self.armer.get_or_insert(armer);
    }
}

/// The mode machine.
///
/// ```
/// use stampfly_mode::{ModeInput, ModeMachine};
/// use stampfly_types::{Micros, messages::*};
///
/// let mut machine = ModeMachine::default();
/// let estimate = StateEstimate { valid: Validity::ALL, ..Default::default() };
/// let calibration = CalibrationResult { complete: true, ..Default::default() };
/// let mut step = |millis, guided: &[GuidedCommand]| {
///     machine.step(Micros::from_millis(millis), &ModeInput {
///         alert: &Default::default(), estimate: &estimate, calibration: &calibration, status: &Default::default(),
///         command: &Default::default(), pilot: None, guided, button: ButtonGesture::None, paired: false,
///     }).mode.state
/// };
/// let command = |kind| [GuidedCommand { kind, ..Default::default() }];
/// assert_eq!(step(0, &[]), FlightState::IdleGround, "calibrated, and the attitude is known");
/// assert_eq!(step(10, &command(GuidedKind::Arm)), FlightState::Armed);
/// assert_eq!(step(20, &command(GuidedKind::TakeOff)), FlightState::Armed, "spooling up");
/// assert_eq!(step(310, &[]), FlightState::TakeOff);
/// assert_eq!(step(320, &command(GuidedKind::Kill)), FlightState::IdleGround);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ModeMachine {
    config: ModeConfig,
    output: ModeOutput,
    entered_at: Micros,
    last: Option<Transition>,
    /// The mode asked for; the one in force may be simpler.
    wanted: FlightMode,
    /// The pilot's previous mode switch and arm switch.
    switches: Option<(FlightMode, bool)>,
    /// The arm switch has been seen off since it last armed or was last refused.
    switch_ready: bool,
    armer: Option<Armer>,
    take_off_wanted: bool,
    crashed: bool,
    link_lost: Persist,
    guidance_lost: Persist,
    estimate_lost: Persist,
    mode_changes: Persist,
}

impl Default for ModeMachine {
    fn default() -> Self {
        Self::new(&ModeConfig::default())
    }
}

impl ModeMachine {
    /// A vehicle that has just been switched on. It wants to hold its position, the calmest mode there is.
    #[must_use]
    pub fn new(config: &ModeConfig) -> Self {
        Self {
            config: *config,
            output: ModeOutput {
                mode: SystemMode { mode: FlightMode::Stabilize, ..SystemMode::default() },
                estimator: EstimatorCommand { on_ground: true, ..EstimatorCommand::default() },
            },
            entered_at: Micros::ZERO,
            last: None,
            wanted: FlightMode::PosHold,
            switches: None,
            switch_ready: false,
            armer: None,
            take_off_wanted: false,
            crashed: false,
            link_lost: Persist::default(),
            guidance_lost: Persist::default(),
            estimate_lost: Persist::default(),
            mode_changes: Persist::default(),
        }
    }

    /// One step: at most one transition.
    pub fn step(&mut self, now: Micros, input: &ModeInput<'_>) -> ModeOutput {
        let mut asked = Asked::default();
        self.read_pilot(input, &mut asked);
        self.read_programs(input, &mut asked);
        self.read_button(input, &mut asked);
        self.choose_mode(now, input, asked.mode);
        self.read_vehicle(now, input, &mut asked.events);
        self.read_take_off(now, input, &mut asked.events);

        self.output.mode.blocks = self.blocks(input, &asked);
        self.decide(now, &asked);
        self.output
    }

    /// The newest transition and its cause.
    #[must_use]
    pub fn last_transition(&self) -> Option<Transition> {
        self.last
    }

    fn state(&self) -> FlightState {
        self.output.mode.state
    }

    fn read_pilot(&mut self, input: &ModeInput<'_>, asked: &mut Asked) {
        let Some(pilot) = input.pilot else { return };
        let before = self.switches.replace((pilot.mode, pilot.arm));
        asked.events.note(Event::Kill, pilot.kill);
        if pilot.arm {
            if self.switch_ready && !pilot.kill {
                asked.arm(Armer::Switch);
            }
            // Used up, whether it arms or is refused.
            self.switch_ready = false;
        } else {
            self.switch_ready = true;
            let switched_off = before.is_some_and(|(_, arm)| arm);
            asked.events.note(Event::Disarm, switched_off);
            self.crashed &= !switched_off;
        }
        // A switch that is moved is a wish; one that merely stands somewhere is not, except on the ground.
        let moved = before.is_none_or(|(mode, _)| mode != pilot.mode);
        let idle = self.state() == FlightState::IdleGround && input.command.source == CommandSource::Pilot;
        if moved || idle {
            self.want(pilot.mode, asked);
        }
    }

    fn read_programs(&mut self, input: &ModeInput<'_>, asked: &mut Asked) {
        for command in input.guided {
            match command.kind {
                GuidedKind::None => {}
                GuidedKind::Kill => asked.events.note(Event::Kill, true),
                GuidedKind::Land => asked.events.note(Event::Land, true),
                GuidedKind::Disarm => {
                    self.crashed = false;
                    asked.events.note(Event::Land, true);
                }
                GuidedKind::Arm => {
                    asked.arm(Armer::Program);
                    self.want(FlightMode::PosHold, asked);
                }
                GuidedKind::TakeOff => {
                    asked.take_off |= asked.armer == Some(Armer::Program);
                    if self.state() == FlightState::Armed {
                        self.take_off_wanted = true;
                        self.want(FlightMode::PosHold, asked);
                    }
                }
                // Whoever has authority may steer; the mode must then be the one that can.
                GuidedKind::WayPoint | GuidedKind::Hold => {
                    if input.command.source == CommandSource::Guided {
                        self.want(FlightMode::PosHold, asked);
                    }
                }
            }
        }
    }

    fn read_button(&mut self, input: &ModeInput<'_>, asked: &mut Asked) {
        match input.button {
            ButtonGesture::None | ButtonGesture::DoubleClick | ButtonGesture::HoldReset => {}
            ButtonGesture::Click => {
                if self.output.mode.armed {
                    asked.events.note(Event::Disarm, true);
                } else if self.crashed {
                    self.crashed = false;
                } else if !input.alert.active.intersects(Alerts::COMM_LOST) {
                    // Without a link nobody could stop what a finger started.
                    asked.arm(Armer::Button);
                }
            }
            ButtonGesture::HoldPair => {
                if !self.output.mode.armed {
                    self.output.mode.pairing = !self.output.mode.pairing;
                }
            }
        }
        if input.paired {
            self.output.mode.pairing = false;
        }
    }

    fn want(&mut self, mode: FlightMode, asked: &mut Asked) {
        asked.mode |= mode != self.wanted;
        self.wanted = mode;
    }

    /// What the vehicle and the failsafe report.
    fn read_vehicle(&mut self, now: Micros, input: &ModeInput<'_>, events: &mut Events) {
        let alerts = input.alert.active;
        let state = self.state();
        let mode = self.output.mode.mode;
        let contact = input.status.contact;

        let crash = Alerts::IMPACT | Alerts::GYRO_ANOMALY | Alerts::TUMBLED | Alerts::IMU_LOST;
        events.note(Event::Crash, alerts.intersects(crash));
        events.note(Event::BatteryCritical, alerts.intersects(Alerts::CRITICAL_BATTERY));

        let vertical_lost = holds_height(mode) && !serves(input.estimate.valid, FlightMode::AltHold);
        let lost_for_long = self.estimate_lost.holds(now, vertical_lost, self.config.estimate_grace);
        events.note(Event::EstimateLost, lost_for_long || alerts.intersects(Alerts::ESTIMATE_DIVERGED));

        let silent = alerts.intersects(Alerts::COMM_LOST);
        let grace = if holds_height(mode) { self.config.link_grace } else { Micros::ZERO };
        events.note(Event::LinkLost, self.link_lost.holds(now, silent && armed(state), grace));

        let adrift = input.command.source == CommandSource::Guided
            && mode != FlightMode::PosHold
            && matches!(state, FlightState::TakeOff | FlightState::Flying);
        events.note(Event::GuidanceLost, self.guidance_lost.holds(now, adrift, self.config.guidance_grace));

        let time = now.since(self.entered_at);
        let standing = state == FlightState::Armed
            && (alerts.intersects(Alerts::TILT_MISMATCH | Alerts::COMM_LOST | Alerts::USB_POWER)
                || time >= self.config.armed_timeout);
        let stuck =
            state == FlightState::TakeOff && contact == GroundContact::Ground && time >= self.config.take_off_timeout;
        events.note(Event::Unsafe, standing || stuck);

        events.note(Event::Landed, input.status.landed);
        events.note(Event::TakeOffComplete, input.status.takeoff_complete);
        events.note(Event::Lifted, contact == GroundContact::Air);
        events.note(Event::SetDown, contact == GroundContact::Ground);
        let ready = input.calibration.complete && input.estimate.valid.contains(Validity::TILT);
        events.note(Event::Ready, ready);
    }

    fn read_take_off(&mut self, now: Micros, input: &ModeInput<'_>, events: &mut Events) {
        if self.state() != FlightState::Armed || now.since(self.entered_at) < self.config.spool {
            return;
        }
        let by_itself = self.armer == Some(Armer::Switch) && holds_height(self.output.mode.mode);
        let by_throttle =
            input.command.source == CommandSource::Pilot && input.command.throttle > self.config.throttle_take_off;
        events.note(Event::TakeOff, self.take_off_wanted || by_itself || by_throttle);
    }

    fn blocks(&self, input: &ModeInput<'_>, asked: &Asked) -> ArmBlocks {
        let pilot = input.pilot;
        let switch_on = pilot.is_some_and(|pilot| pilot.arm);
        arming::blocks(&ArmingFacts {
            state: self.state(),
            mode: self.output.mode.mode,
            contact: input.status.contact,
            calibrated: input.calibration.complete,
            valid: input.estimate.valid,
            attitude: input.estimate.attitude,
            alerts: input.alert.active,
            pairing: self.output.mode.pairing,
            throttle: pilot.map_or(0.0, |pilot| pilot.throttle),
            // The edge of this very step is fresh, not stuck.
            switch_stuck: switch_on && !self.switch_ready && asked.armer != Some(Armer::Switch),
            crashed: self.crashed,
        })
    }

    /// The mode in force: the wanted one, or the nearest that can be flown.
    fn choose_mode(&mut self, now: Micros, input: &ModeInput<'_>, asked: bool) {
        let in_air = match self.state() {
            // A mode does not change under a climb or a descent.
            FlightState::TakeOff | FlightState::Landing => return,
            FlightState::Flying => true,
            FlightState::Init | FlightState::IdleGround | FlightState::IdleHeld | FlightState::Armed => false,
        };
        let current = self.output.mode.mode;
        let possible = fly_able(self.wanted, input.estimate.valid);
        // In the air a height that is held is only given up on the pilot's own wish.
        let possible =
            if in_air && holds_height(self.wanted) && !holds_height(possible) { FlightMode::AltHold } else { possible };
        let settled = self.mode_changes.holds(now, possible != current, self.config.mode_settle);
        if possible != current && (!in_air || asked || settled) {
            self.output.mode.mode = possible;
            self.mode_changes.reset();
        }
    }

    fn decide(&mut self, now: Micros, asked: &Asked) {
        let facts = Facts { blocks: self.output.mode.blocks, manual: !holds_height(self.output.mode.mode) };
        for event in asked.events.iter() {
            match next(self.state(), event, &facts) {
                // Where an emergency has nothing to stop, it still keeps anything from starting.
                Decision::Stay | Decision::Refuse(_) if event <= Event::Crash => return,
                Decision::Stay | Decision::Refuse(_) => {}
                Decision::Go(to) => {
                    self.go(now, to, event, asked);
                    return;
                }
            }
        }
    }

    fn go(&mut self, now: Micros, to: FlightState, event: Event, asked: &Asked) {
        let from = self.state();
        self.last = Some(Transition { at: now, from, to, event });
        self.on_exit(from, event);
        self.entered_at = now;
        self.output.mode.state = to;
        self.output.mode.armed = armed(to);
        self.output.mode.transitions = self.output.mode.transitions.wrapping_add(1);
        self.on_enter(from, to, event, asked);
    }

    fn on_exit(&mut self, from: FlightState, event: Event) {
        if armed(from) && event == Event::Crash {
            self.crashed = true;
        }
    }

    fn on_enter(&mut self, from: FlightState, to: FlightState, event: Event, asked: &Asked) {
        let estimator = &mut self.output.estimator;
        estimator.on_ground = match to {
            FlightState::Init | FlightState::IdleGround | FlightState::Armed => true,
            FlightState::IdleHeld | FlightState::TakeOff | FlightState::Flying | FlightState::Landing => false,
        };
        match to {
            FlightState::Armed => {
                // The flight begins here: this is the origin, and the controller remembers nothing.
                self.armer = asked.armer;
                self.take_off_wanted = asked.take_off;
                estimator.origin_resets = estimator.origin_resets.wrapping_add(1);
                self.output.mode.control_resets = self.output.mode.control_resets.wrapping_add(1);
            }
            FlightState::IdleGround => {
                self.armer = None;
                self.take_off_wanted = false;
                // After a hand or a crash the estimate may be anything.
                if from == FlightState::IdleHeld || event == Event::Crash {
                    estimator.full_resets = estimator.full_resets.wrapping_add(1);
                }
                self.output.mode.control_resets = self.output.mode.control_resets.wrapping_add(1);
            }
            FlightState::Init
            | FlightState::IdleHeld
            | FlightState::TakeOff
            | FlightState::Flying
            | FlightState::Landing => {}
        }
    }
}

/// The wanted mode, or the nearest simpler one that these outputs of the estimator can serve.
fn fly_able(wanted: FlightMode, valid: Validity) -> FlightMode {
    let simpler: &[FlightMode] = match wanted {
        FlightMode::PosHold => &[FlightMode::PosHold, FlightMode::AltHold, FlightMode::Stabilize],
        FlightMode::AltHold => &[FlightMode::AltHold, FlightMode::Stabilize],
        FlightMode::Stabilize => &[FlightMode::Stabilize],
        FlightMode::Acro => &[FlightMode::Acro],
    };
    simpler.iter().copied().find(|mode| serves(valid, *mode)).unwrap_or(FlightMode::Stabilize)
}
