//! Control: state and set-point in, thrust and torque out.

use super::command::present;
use crate::config::{ControllerKind, VehicleConfig};
use crate::topics::ControlEnds;
use stampfly_bus::{Activation, Runnable};
use stampfly_control::indi::IndiRate;
use stampfly_control::{
    CascadeController, ControlInput, Controller, FlipController, GeometricController, IndiController,
};
use stampfly_types::Instant;
use stampfly_types::messages::{ControlOutput, FlightPhase};

/// The controllers this vehicle can be told to use (`controller.type`).
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
#[allow(clippy::large_enum_variant, reason = "there is one of them, for as long as the vehicle is on")]
enum Choice {
    Cascade(CascadeController),
    Geometric(GeometricController),
    Indi(IndiController),
}

/// Control: state and set-point in, thrust and torque out.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
pub struct Control {
    controller: Choice,
    /// Flies in its place while the vehicle turns over.
    flip: FlipController,
    /// The phase of the step before.
    phase: FlightPhase,
}

impl Control {
    /// A controller at rest.
    #[must_use]
    pub fn new(config: &VehicleConfig) -> Self {
        let controller = match config.controller {
            ControllerKind::Geometric => Choice::Geometric(GeometricController::new(&config.geometric)),
            ControllerKind::Indi => {
                Choice::Indi(IndiController::with_rate_law(&config.cascade, IndiRate::new(&config.indi)))
            }
            ControllerKind::Cascade => Choice::Cascade(CascadeController::new(&config.cascade)),
        };
        let flip = FlipController::new(&config.flip, &config.indi);
        Self { controller, flip, phase: FlightPhase::Init }
    }
}

impl Runnable for Control {
    type Ends<'b> = ControlEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut ControlEnds<'_>) {
        if let Some(output) = self.turn_over(activation.now(), ends) {
            ends.control_output.publish(activation.now(), &output);
            return;
        }
        let command = present(ends.command_setpoint.sample(), activation.now());
        // Until a topic has its first sample its message's default stands in: nothing valid, not armed.
        let input = ControlInput {
            estimate: ends.estimate_state.get(),
            command: &command,
            setpoint: ends.setpoint.get(),
            flight_status: ends.flight_status.get(),
            land_detected: ends.land_detected.get(),
            unmet: ends.actuator_motor.get().unmet,
        };
        let output = match &mut self.controller {
            Choice::Cascade(controller) => controller.step(activation.now(), &input),
            Choice::Geometric(controller) => controller.step(activation.now(), &input),
            Choice::Indi(controller) => controller.step(activation.now(), &input),
        };
        ends.control_output.publish(activation.now(), &output);
    }
}

impl Control {
    /// Thrust and torque of a flip, while one is flown.
    fn turn_over(&mut self, now: Instant, ends: &ControlEnds<'_>) -> Option<ControlOutput> {
        let (phase, estimate) = (ends.flight_status.get().phase, ends.estimate_state.get());
        if phase != FlightPhase::Flip {
            self.flip.cancel(now);
        } else if self.phase != FlightPhase::Flip
            && let Some(direction) = ends.setpoint.get().axes.flip()
        {
            // Refused, the vehicle hovers until the phase is over. The battery is up to it: the mode machine has looked.
            let _ = self.flip.start(now, direction, estimate, None);
        }
        self.phase = phase;
        self.flip.step(now, estimate, ends.actuator_motor.get().unmet)
    }
}
