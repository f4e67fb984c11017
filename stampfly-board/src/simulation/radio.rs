//! The radio between the vehicle and whoever flies it, with what can go wrong on it.

use super::faults::RadioLines;
use crate::messages::TelemetryFrame;
use crate::topics;
use stampfly_sim::fault::Line;
use stampfly_sim::time::Clock;
use stampfly_types::messages::{GuidedCommand, PilotInput};

/// A station's end of the radio.
pub struct Radio<'b> {
    clock: Clock,
    ends: topics::LinkEnds<'b>,
    lines: RadioLines,
    frame: TelemetryFrame,
}

impl<'b> Radio<'b> {
    /// One on which nothing goes wrong.
    #[must_use]
    pub fn undisturbed(clock: &Clock, ends: topics::LinkEnds<'b>) -> Self {
        let lines = RadioLines { pilot: Line::clear(), guided: Line::clear(), telemetry: Line::clear() };
        Self::new(clock, ends, lines)
    }

    pub(super) fn new(clock: &Clock, ends: topics::LinkEnds<'b>, lines: RadioLines) -> Self {
        Self { clock: clock.clone(), ends, lines, frame: TelemetryFrame::default() }
    }

    /// Virtual time.
    #[must_use]
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// Sends a program's command. `false` when the vehicle's queue is full; one that is lost on the way is not noticed.
    pub fn command(&mut self, command: GuidedCommand) -> bool {
        let now = self.clock.now();
        let arrived = self.lines.guided.pass(now, &command);
        arrived.is_none_or(|command| self.ends.command_guided.publish(now, command).is_ok())
    }

    /// Sends a frame of the transmitter.
    pub fn sticks(&mut self, input: &PilotInput) {
        let now = self.clock.now();
        if let Some(input) = self.lines.pilot.pass(now, input) {
            self.ends.command_pilot.publish(now, &input);
        }
    }

    /// The newest telemetry that has arrived.
    pub fn telemetry(&mut self) -> TelemetryFrame {
        let newest = self.ends.telemetry.latest();
        if let Some(frame) = newest.and_then(|frame| self.lines.telemetry.pass(self.clock.now(), &frame.data)) {
            self.frame = frame;
        }
        self.frame
    }
}
