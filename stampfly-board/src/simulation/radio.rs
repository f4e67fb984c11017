//! The radio between the vehicle and whoever flies it, with what can go wrong on it.

use super::faults::Wrong;
use crate::messages::TelemetryFrame;
use crate::topics::{self, Id};
use stampfly_sim::fault::Line;
use stampfly_sim::time::Clock;
use stampfly_types::messages::{GuidedCommand, PilotInput};

/// A station's end of the radio.
pub struct Radio<'b> {
    clock: Clock,
    ends: topics::LinkEnds<'b>,
    pilot: Line<PilotInput>,
    guided: Line<GuidedCommand>,
    telemetry: Line<TelemetryFrame>,
    frame: TelemetryFrame,
}

impl<'b> Radio<'b> {
    /// One on which nothing goes wrong.
    #[must_use]
    pub fn undisturbed(clock: &Clock, ends: topics::LinkEnds<'b>) -> Self {
        Self::new(clock, ends, &Wrong::new(&[], clock.now(), 0))
    }

    pub(super) fn new(clock: &Clock, ends: topics::LinkEnds<'b>, wrong: &Wrong) -> Self {
        Self {
            clock: clock.clone(),
            ends,
            pilot: wrong.line(Id::command_pilot),
            guided: wrong.line(Id::command_guided),
            telemetry: wrong.line(Id::telemetry),
            frame: TelemetryFrame::default(),
        }
    }

    /// Virtual time.
    #[must_use]
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// Sends a program's command. `false` when the vehicle's queue is full; one that is lost on the way is not noticed.
    pub fn command(&mut self, command: GuidedCommand) -> bool {
        let now = self.clock.now();
        let arrived = self.guided.pass(now, &command);
        arrived.is_none_or(|command| self.ends.command_guided.publish(now, command).is_ok())
    }

    /// Sends a frame of the transmitter.
    pub fn sticks(&mut self, input: &PilotInput) {
        let now = self.clock.now();
        if let Some(input) = self.pilot.pass(now, input) {
            self.ends.command_pilot.publish(now, &input);
        }
    }

    /// The newest telemetry that has arrived.
    pub fn telemetry(&mut self) -> TelemetryFrame {
        let newest = self.ends.telemetry.latest();
        if let Some(frame) = newest.and_then(|frame| self.telemetry.pass(self.clock.now(), &frame.data)) {
            self.frame = frame;
        }
        self.frame
    }
}
