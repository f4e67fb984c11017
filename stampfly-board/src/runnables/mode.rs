//! State management: alerts, commands and facts in, the vehicle's state out.

use crate::config::VehicleConfig;
use crate::topics::ModeEnds;
use heapless::Vec;
use stampfly_bus::{Activation, Runnable, Stamped};
use stampfly_mode::{ModeInput, ModeMachine};
use stampfly_types::Duration;
use stampfly_types::messages::{ButtonGesture, EstimatorCommand, GuidedKind, PilotInput};

/// A pilot's frame as old as this counts as none.
const STALE_PILOT: Duration = Duration::from_millis(500);

/// State management: alerts, commands and facts in, the vehicle's state out.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
pub struct Mode {
    machine: ModeMachine,
    pilot: Option<Stamped<PilotInput>>,
    published: Option<EstimatorCommand>,
}

impl Mode {
    /// A vehicle that has just been switched on.
    #[must_use]
    pub fn new(_: &VehicleConfig) -> Self {
        Self::default()
    }
}

impl Runnable for Mode {
    type Ends<'b> = ModeEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut ModeEnds<'_>) {
        let now = activation.now();
        self.pilot = ends.command_pilot.last().copied().or(self.pilot);
        let mut commands = Vec::<GuidedKind, 16>::new();
        for command in ends.command_guided.iter() {
            // As many as the queue holds.
            let _ = commands.push(command.data.kind);
        }
        // There is one event in a step, unless the loop was held up. Then the one that stops the motors counts.
        let newest = ends.button_event.last().map(|event| event.data.gesture);
        let mut gestures = ends.button_event.iter().map(|event| event.data.gesture);
        let button = gestures.find(|gesture| *gesture == ButtonGesture::Press).or(newest);
        let input = ModeInput {
            alerts: ends.system_alert.get().active,
            estimate: ends.estimate_state.get(),
            calibration: ends.calibration.get(),
            land_detected: ends.land_detected.get(),
            pilot: self.pilot.as_ref().filter(|frame| frame.age(now) < STALE_PILOT).map(|frame| &frame.data),
            commands: &commands,
            button,
        };
        let output = self.machine.step(now, &input);
        ends.system_mode.publish(now, &output.mode);
        // The command holds until it changes, so only a change is published.
        if self.published != Some(output.estimator) {
            ends.estimator_command.publish(now, &output.estimator);
        }
        self.published = Some(output.estimator);
    }
}
