//! State management: alerts, commands and facts in, the vehicle's state out.

use super::command::present;
use crate::config::VehicleConfig;
use crate::messages::RestartRequest;
use crate::topics::ModeEnds;
use heapless::Vec;
use stampfly_bus::{Activation, Runnable, Stamped};
use stampfly_mode::{ModeConfig, ModeInput, ModeMachine};
#[cfg(feature = "simulation")]
use stampfly_mode::{decision::CUT, transitions::is_airborne};
use stampfly_types::messages::{
    Alerts, ArmRefusals, ButtonGesture, EstimatorCommand, FlightStatus, GuidedKind, PilotInput,
};
use stampfly_types::{Duration, Instant};

/// State management: alerts, commands and facts in, the vehicle's state out.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
pub struct Mode {
    machine: ModeMachine,
    /// A pilot's frame as old as this counts as none.
    stale_pilot: Duration,
    pilot: Option<Stamped<PilotInput>>,
    published: Option<EstimatorCommand>,
    /// Refusals to arm since power-on.
    refused: u32,
    /// The decision of the step before.
    last: FlightStatus,
    /// When the vehicle was last armed.
    armed_at: Instant,
    /// Protections stop no motors in the air. Not in key frames, which a board writes as well.
    #[cfg(feature = "simulation")]
    #[serde(skip)]
    flies_on: bool,
}

impl Mode {
    /// A vehicle that has just been switched on.
    #[must_use]
    pub fn new(config: &VehicleConfig) -> Self {
        Self {
            // Over the navigator's largest height no flip rises, either.
            machine: ModeMachine::new(ModeConfig { ceiling: config.navigator.height_max, ..config.mode }),
            // The frames that count for the sticks count here, too.
            stale_pilot: config.authority.stale,
            pilot: None,
            published: None,
            refused: 0,
            last: FlightStatus::default(),
            armed_at: Instant::ZERO,
            #[cfg(feature = "simulation")]
            flies_on: config.flies_on,
        }
    }

    /// Alerts, and whether the motors were cut off, for the mode machine.
    #[cfg(not(feature = "simulation"))]
    const fn protections(&self, alerts: Alerts, cut_off: bool) -> (Alerts, bool) {
        (alerts, cut_off)
    }

    /// The same. In a flight that is to fly on they lack in the air all that stops motors.
    #[cfg(feature = "simulation")]
    fn protections(&self, alerts: Alerts, cut_off: bool) -> (Alerts, bool) {
        let masked = self.flies_on && is_airborne(self.last.phase);
        if masked { (alerts.without(CUT), false) } else { (alerts, cut_off) }
    }
}

impl Runnable for Mode {
    type Ends<'b> = ModeEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut ModeEnds<'_>) {
        let now = activation.now();
        self.pilot = ends.command_pilot.last().copied().or(self.pilot);
        // As many as the queue holds.
        let mut commands = Vec::<GuidedKind, 16>::new();
        for command in ends.command_guided.iter() {
            let _ = commands.push(command.data.kind);
        }
        // There is one event in a step, unless the loop was held up. Then the one that stops the motors counts.
        let newest = ends.button_event.last().map(|event| event.data.gesture);
        let mut gestures = ends.button_event.iter().map(|event| event.data.gesture);
        let button = gestures.find(|gesture| *gesture == ButtonGesture::Press).or(newest);
        // The console asks for what a long press toggles. Not in flight: there the link keeps its transmitter.
        let pairing = Some(ends.pairing_request.get().wanted).filter(|_| ends.pairing_request.is_new());
        let pairing = pairing.filter(|wanted| *wanted != self.last.pairing && !self.last.armed);
        let button = button.or(pairing.map(|_| ButtonGesture::HoldPair));
        // Motors that were cut off stay so until the vehicle is disarmed, and it cannot fly on
        // without them.
        let (alerts, cut_off) = self.protections(ends.system_alert.get().active, ends.cutoff_state.get().tripped);
        let input = ModeInput {
            alerts,
            estimate: ends.estimate_state.get(),
            calibration: ends.calibration.get(),
            land_detected: ends.land_detected.get(),
            pilot: self
                .pilot
                .as_ref()
                .filter(|frame| frame.age(now) < self.stale_pilot)
                .map(|frame| (frame.at, &frame.data)),
            sticks: present(ends.command_setpoint.sample(), now).source,
            commands: &commands,
            button,
            cut_off,
        };
        let output = self.machine.step(now, &input);
        ends.flight_status.publish(now, &output.flight_status);
        self.last = output.flight_status;
        if output.refused {
            self.refused = self.refused.saturating_add(1);
            let mut refusals = ArmRefusals { attempts: self.refused, ..ArmRefusals::default() };
            for refusal in self.machine.refusals() {
                refusals.blocks |= refusal.check;
            }
            let entries =
                refusals.check.iter_mut().zip(&mut refusals.value).zip(&mut refusals.limit).zip(&mut refusals.since);
            for (refusal, (((check, value), limit), since)) in self.machine.refusals().zip(entries) {
                (*check, *value, *limit, *since) = (refusal.check, refusal.value, refusal.limit, refusal.since);
            }
            ends.arm_refusals.publish(now, &refusals);
        }
        if output.flight_status.armed {
            self.armed_at = now;
        }
        // A press that stopped the motors and was held on does not count: a restart would lose the black box.
        let reset = ends.button_event.iter().find(|event| event.data.gesture == ButtonGesture::HoldReset);
        if reset.is_some_and(|event| event.at.since(self.armed_at).seconds() > event.data.held) {
            ends.restart_request.publish(now, &RestartRequest { requested: true });
        }
        // The command holds until it changes, so only a change is published.
        if self.published != Some(output.estimator) {
            ends.estimator_command.publish(now, &output.estimator);
        }
        self.published = Some(output.estimator);
    }
}
