//! State management: alerts, commands and facts in, the vehicle's state out.

use crate::wiring;
use heapless::Vec;
use stampfly_bus::{Activation, Runnable, Stamped};
use stampfly_mode::{ModeInput, ModeMachine};
use stampfly_types::Duration;
use stampfly_types::messages::*;

/// A pilot's frame older than this is no frame.
const STALE_PILOT: Duration = Duration::from_millis(500);

/// State management: alerts, commands and facts in, the vehicle's state out.
pub struct ModeManager<'b> {
    ports: ModePorts<'b>,
    machine: ModeMachine,
    alerts: Alerts,
    estimate: StateEstimate,
    calibration: CalibrationResult,
    status: VehicleStatus,
    pilot: Option<PilotInput>,
    commands: Vec<Stamped<GuidedCommand>, 16>,
    gestures: Vec<Stamped<ButtonEvent>, 4>,
    published: Option<EstimatorCommand>,
}

/// The ends it owns.
pub struct ModePorts<'b> {
    /// The failsafe's findings.
    pub alert: wiring::system_alert::Rx<'b>,
    /// The state.
    pub estimate: wiring::estimate_state::Rx<'b>,
    /// Still-calibration.
    pub calibration: wiring::calibration::Rx<'b>,
    /// Take-off and landing.
    pub status: wiring::vehicle_status::Rx<'b>,
    /// The pilot's frames.
    pub pilot: wiring::command_pilot::Rx<'b>,
    /// Commands from programs.
    pub guided: wiring::command_guided::Rx<'b>,
    /// The button.
    pub button: wiring::button_event::Rx<'b>,
    /// State and mode.
    pub mode: wiring::system_mode::Tx<'b>,
    /// For the estimator.
    pub estimator: wiring::estimator_command::Tx<'b>,
}

impl<'b> ModeManager<'b> {
    /// A vehicle at power-on.
    #[must_use]
    pub fn new(ports: ModePorts<'b>) -> Self {
        Self {
            ports,
            machine: ModeMachine::default(),
            alerts: Alerts::NONE,
            estimate: StateEstimate::default(),
            calibration: CalibrationResult::default(),
            status: VehicleStatus::default(),
            pilot: None,
            commands: Vec::new(),
            gestures: Vec::new(),
            published: None,
        }
    }
}

impl Runnable for ModeManager<'_> {
    fn read(&mut self, activation: &mut Activation) {
        let now = activation.now();
        self.alerts = activation.latest(&mut self.ports.alert).map(|s| s.data.active).unwrap_or_default();
        activation.update(&mut self.ports.estimate, &mut self.estimate);
        activation.update(&mut self.ports.calibration, &mut self.calibration);
        activation.update(&mut self.ports.status, &mut self.status);
        let pilot = activation.latest(&mut self.ports.pilot);
        self.pilot = pilot.filter(|s| s.age(now) < STALE_PILOT).map(|s| s.data);
        activation.drain(&mut self.ports.guided, &mut self.commands);
        activation.drain(&mut self.ports.button, &mut self.gestures);
    }

    fn run(&mut self, activation: &mut Activation) {
        let mut commands = Vec::<GuidedKind, 16>::new();
        for command in &self.commands {
            // As many as the queue holds.
            let _ = commands.push(command.data.kind);
        }
        // One in a step, but for a loop that was held up: then what stops the motors is not missed.
        let mut gestures = self.gestures.iter().map(|s| s.data.gesture);
        let newest = self.gestures.last().map(|s| s.data.gesture);
        let button = gestures.find(|gesture| *gesture == ButtonGesture::Press).or(newest);
        let input = ModeInput {
            alerts: self.alerts,
            estimate: &self.estimate,
            calibration: &self.calibration,
            status: &self.status,
            pilot: self.pilot.as_ref(),
            commands: &commands,
            button,
        };
        let output = self.machine.step(activation.now(), &input);
        self.ports.mode.publish(activation.now(), &output.mode);
        // Level-triggered, so only a change is news.
        if self.published != Some(output.estimator) {
            self.ports.estimator.publish(activation.now(), &output.estimator);
        }
        self.published = Some(output.estimator);
    }
}
