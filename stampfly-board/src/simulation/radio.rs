//! The radio between the vehicle and whoever flies it, with what can go wrong on it.

use super::air;
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
    /// The secure session, if the pilot's frames and telemetry go as its bytes.
    air: Option<air::Shared>,
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
            air: None,
        }
    }

    /// The same, with the secure session on it.
    pub(super) fn over(self, air: air::Shared) -> Self {
        Self { air: Some(air), ..self }
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
        let mut arrived = self.pilot.pass(now, input);
        if let Some(air) = &self.air {
            let armed = self.ends.flight_status.latest().is_some_and(|status| status.data.armed);
            arrived = air.borrow_mut().sticks(now, &arrived.unwrap_or(*input), armed, arrived.is_some());
        }
        if let Some(input) = arrived {
            self.ends.command_pilot.publish(now, &input);
        }
    }

    /// The newest telemetry that has arrived.
    pub fn telemetry(&mut self) -> TelemetryFrame {
        let newest = self.ends.telemetry.latest();
        let now = self.clock.now();
        if let Some(frame) = newest.and_then(|frame| self.telemetry.pass(now, &frame.data))
            && self.air.as_ref().is_none_or(|air| air.borrow_mut().telemetry(now, &frame))
        {
            self.frame = frame;
        }
        self.frame
    }
}
