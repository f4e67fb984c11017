//! Command: every source of commands in, one arbitrated set of sticks out.

use crate::config::VehicleConfig;
use crate::topics::CommandEnds;
use stampfly_bus::{Activation, Runnable};
use stampfly_mode::Authority;
use stampfly_types::messages::GuidedKind;

/// Command: every source of commands in, one arbitrated set of sticks out.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
pub struct Command {
    authority: Authority,
}

impl Command {
    /// No source has authority.
    #[must_use]
    pub fn new(config: &VehicleConfig) -> Self {
        Self { authority: Authority::new(config.authority) }
    }
}

impl Runnable for Command {
    type Ends<'b> = CommandEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut CommandEnds<'_>) {
        for frame in ends.command_pilot.iter() {
            self.authority.pilot(frame.at, &frame.data);
        }
        for command in ends.command_guided.iter() {
            if command.data.kind == GuidedKind::None {
                self.authority.guided_alive(command.at);
            } else {
                self.authority.guided(command.at);
            }
        }
        let setpoint = self.authority.step(activation.now());
        ends.command_setpoint.publish(activation.now(), &setpoint);
    }
}
