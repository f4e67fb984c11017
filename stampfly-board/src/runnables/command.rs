//! Command: every source of commands in, one arbitrated set of sticks out.

use crate::wiring;
use heapless::Vec;
use stampfly_bus::{Activation, Runnable, Stamped};
use stampfly_mode::Authority;
use stampfly_types::messages::*;

/// Command: every source of commands in, one arbitrated set of sticks out.
pub struct Command<'b> {
    ports: CommandPorts<'b>,
    authority: Authority,
    pilot_frames: Vec<Stamped<PilotInput>, 8>,
    guided_commands: Vec<Stamped<GuidedCommand>, 16>,
}

/// The ends it owns.
pub struct CommandPorts<'b> {
    /// The pilot's frames.
    pub pilot: wiring::command_pilot::Rx<'b>,
    /// Commands from programs.
    pub guided: wiring::command_guided::Rx<'b>,
    /// The sticks that count.
    pub setpoint: wiring::command_setpoint::Tx<'b>,
}

impl<'b> Command<'b> {
    /// Nobody has commanded anything yet.
    #[must_use]
    pub fn new(ports: CommandPorts<'b>) -> Self {
        Self { ports, authority: Authority::default(), pilot_frames: Vec::new(), guided_commands: Vec::new() }
    }
}

impl Runnable for Command<'_> {
    fn read(&mut self, activation: &mut Activation) {
        activation.drain(&mut self.ports.pilot, &mut self.pilot_frames);
        activation.drain(&mut self.ports.guided, &mut self.guided_commands);
    }

    fn run(&mut self, activation: &mut Activation) {
        for frame in &self.pilot_frames {
            self.authority.pilot(frame.at, &frame.data);
        }
        for command in &self.guided_commands {
            if command.data.kind == GuidedKind::None {
                self.authority.guided_alive(command.at);
            } else {
                self.authority.guided(command.at);
            }
        }
        self.ports.setpoint.publish(activation.now(), &self.authority.step(activation.now()));
    }
}
