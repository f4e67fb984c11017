//! Navigator: commands and state in, the vehicle's path out.

use crate::wiring;
use heapless::Vec;
use stampfly_bus::{Activation, Runnable, Stamped};
use stampfly_control::guidance::{Navigator, NavigatorInput};
use stampfly_types::messages::*;

/// Navigator: commands and state in, the vehicle's path out.
pub struct Navigation<'b> {
    ports: NavigationPorts<'b>,
    navigator: Navigator,
    mode: SystemMode,
    estimate: StateEstimate,
    status: VehicleStatus,
    command: CommandSetpoint,
    commands: Vec<Stamped<GuidedCommand>, 16>,
}

/// The ends it owns.
pub struct NavigationPorts<'b> {
    /// Commands from programs.
    pub guided: wiring::command_guided::Rx<'b>,
    /// State and mode.
    pub mode: wiring::system_mode::Rx<'b>,
    /// The state.
    pub estimate: wiring::estimate_state::Rx<'b>,
    /// Take-off and landing.
    pub status: wiring::vehicle_status::Rx<'b>,
    /// The sticks.
    pub command: wiring::command_setpoint::Rx<'b>,
    /// The path.
    pub setpoint: wiring::setpoint::Tx<'b>,
}

impl<'b> Navigation<'b> {
    /// A navigator at the origin.
    #[must_use]
    pub fn new(ports: NavigationPorts<'b>) -> Self {
        Self {
            ports,
            navigator: Navigator::default(),
            mode: SystemMode::default(),
            estimate: StateEstimate::default(),
            status: VehicleStatus::default(),
            command: CommandSetpoint::default(),
            commands: Vec::new(),
        }
    }
}

impl Runnable for Navigation<'_> {
    fn read(&mut self, activation: &mut Activation) {
        activation.drain(&mut self.ports.guided, &mut self.commands);
        activation.update(&mut self.ports.mode, &mut self.mode);
        activation.update(&mut self.ports.estimate, &mut self.estimate);
        activation.update(&mut self.ports.status, &mut self.status);
        activation.update(&mut self.ports.command, &mut self.command);
    }

    fn run(&mut self, activation: &mut Activation) {
        for command in &self.commands {
            // A refusal is counted by the navigator; the sender sees it in `remaining`.
            let _ = self.navigator.accept(&command.data);
        }
        let input =
            NavigatorInput { mode: &self.mode, estimate: &self.estimate, status: &self.status, command: &self.command };
        self.ports.setpoint.publish(activation.now(), &self.navigator.step(activation.now(), &input));
    }
}
