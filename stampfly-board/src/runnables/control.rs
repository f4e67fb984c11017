//! Control: state and set-point in, thrust and torque out.

use crate::config::VehicleConfig;
use crate::wiring;
use stampfly_bus::{Activation, Runnable};
use stampfly_control::{CascadeController, ControlInput, Controller, GeometricController};
use stampfly_types::messages::*;

/// The controllers this vehicle can be told to use (`controller.type`).
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "one of them exists, for as long as the vehicle does")]
enum Choice {
    Cascade(CascadeController),
    Geometric(GeometricController),
}

/// Control: state and set-point in, thrust and torque out.
pub struct Control<'b> {
    ports: ControlPorts<'b>,
    controller: Choice,
    estimate: StateEstimate,
    command: CommandSetpoint,
    setpoint: Setpoint,
    mode: SystemMode,
    status: VehicleStatus,
    unmet: [f32; 4],
}

/// The ends it owns.
pub struct ControlPorts<'b> {
    /// The state.
    pub estimate: wiring::estimate_state::Rx<'b>,
    /// The sticks.
    pub command: wiring::command_setpoint::Rx<'b>,
    /// The path.
    pub setpoint: wiring::setpoint::Rx<'b>,
    /// State and mode.
    pub mode: wiring::system_mode::Rx<'b>,
    /// Contact with the ground.
    pub status: wiring::vehicle_status::Rx<'b>,
    /// What the motors could not do one step ago.
    pub motors: wiring::actuator_motor::Rx<'b>,
    /// Thrust and torque.
    pub output: wiring::control_output::Tx<'b>,
}

impl<'b> Control<'b> {
    /// A controller at rest.
    #[must_use]
    pub fn new(ports: ControlPorts<'b>, config: &VehicleConfig) -> Self {
        let controller = if config.uses_geometric_controller() {
            Choice::Geometric(GeometricController::new(&config.geometric))
        } else {
            Choice::Cascade(CascadeController::new(&config.cascade))
        };
        Self {
            ports,
            controller,
            estimate: StateEstimate::default(),
            command: CommandSetpoint::default(),
            setpoint: Setpoint::default(),
            mode: SystemMode::default(),
            status: VehicleStatus::default(),
            unmet: [0.0; 4],
        }
    }
}

impl Runnable for Control<'_> {
    fn read(&mut self, activation: &mut Activation) {
        // Until a topic has its first sample its message's default stands in: nothing valid, not armed.
        activation.update(&mut self.ports.estimate, &mut self.estimate);
        activation.update(&mut self.ports.command, &mut self.command);
        activation.update(&mut self.ports.setpoint, &mut self.setpoint);
        activation.update(&mut self.ports.mode, &mut self.mode);
        activation.update(&mut self.ports.status, &mut self.status);
        self.unmet = activation.latest(&mut self.ports.motors).map_or([0.0; 4], |s| s.data.unmet);
    }

    fn run(&mut self, activation: &mut Activation) {
        let input = ControlInput {
            estimate: &self.estimate,
            command: &self.command,
            setpoint: &self.setpoint,
            mode: &self.mode,
            status: &self.status,
            unmet: self.unmet,
        };
        let output = match &mut self.controller {
            Choice::Cascade(controller) => controller.step(activation.now(), &input),
            Choice::Geometric(controller) => controller.step(activation.now(), &input),
        };
        self.ports.output.publish(activation.now(), &output);
    }
}
