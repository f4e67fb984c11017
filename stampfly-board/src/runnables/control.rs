//! Control: state and set-point in, thrust and torque out.

use super::command::present;
use crate::airframe::AIRFRAME;
use crate::config::{ControllerKind, VehicleConfig};
use crate::topics::ControlEnds;
use stampfly_bus::{Activation, Runnable};
use stampfly_control::autotune::{AutotuneAxis, AutotuneInput};
use stampfly_control::indi::IndiRate;
use stampfly_control::rate::RateConfig;
use stampfly_control::{
    Autotune, CascadeController, ControlInput, Controller, FlipConfig, FlipController, GeometricController,
    IndiController, PidGains,
};
use stampfly_mode::decision::LAND;
use stampfly_types::messages::ControlOutput;

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
    /// Measures a rate loop when it is asked to.
    autotune: Autotune,
    /// The gains that the cascade flies with.
    rate: RateConfig,
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
        Self {
            controller,
            flip: FlipController::new(&FlipConfig::for_airframe(&AIRFRAME), &config.indi),
            autotune: Autotune::for_airframe(&AIRFRAME),
            rate: config.cascade.rate,
        }
    }
}

impl Control {
    /// Takes the gains, and keeps every state. A rate loop that is being measured is another one then.
    pub(crate) fn set_gains(&mut self, config: &VehicleConfig) {
        match &mut self.controller {
            Choice::Cascade(controller) => controller.set_gains(&config.cascade),
            Choice::Indi(controller) => controller.set_gains(&config.cascade, &config.indi),
            Choice::Geometric(_) => {}
        }
        self.flip.set_gains(&config.indi);
        if self.rate != config.cascade.rate {
            self.autotune.cancel();
            self.rate = config.cascade.rate;
        }
    }
}

impl Runnable for Control {
    type Ends<'b> = ControlEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut ControlEnds<'_>) {
        let (now, estimate, unmet) = (activation.now(), ends.estimate_state.get(), ends.actuator_motor.get().unmet);
        let phase = ends.flight_status.get().phase;
        if ends.system_alert.get().active.intersects(LAND) {
            self.flip.abort(now);
        }
        if let Some(output) = self.flip.follow(now, phase, ends.setpoint.get(), estimate, unmet) {
            ends.control_output.publish(now, &output);
            return;
        }
        let command = present(ends.command_setpoint.sample(), now);
        // Until a topic has its first sample its message's default stands in: nothing valid, not armed.
        let input = ControlInput {
            estimate,
            command: &command,
            setpoint: ends.setpoint.get(),
            flight_status: ends.flight_status.get(),
            land_detected: ends.land_detected.get(),
            unmet,
        };
        let output = match &mut self.controller {
            Choice::Cascade(controller) => controller.step(now, &input),
            Choice::Geometric(controller) => controller.step(now, &input),
            Choice::Indi(controller) => controller.step(now, &input),
        };
        let conditions = AutotuneInput::of(&input, ends.system_alert.get().active);
        let tunes = matches!(self.controller, Choice::Cascade(_));
        let present = |axis: AutotuneAxis| if tunes { axis.gains(&self.rate) } else { PidGains::proportional(0.0) };
        let torque = self.autotune.follow(now, input.setpoint.axes, present, &conditions, &output.torque);
        ends.control_output.publish(now, &ControlOutput { torque, ..output });
        if let Some(status) = self.autotune.news() {
            ends.autotune.publish(now, &status);
        }
    }
}
