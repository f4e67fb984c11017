//! The radio between the vehicle and whoever flies it, with what can go wrong on it.

use super::air;
use super::faults::Wrong;
use crate::messages::TelemetryFrame;
use crate::topics::{self, Id};
use stampfly_link::secure::Payload;
use stampfly_sim::fault::Line;
use stampfly_sim::time::Clock;
use stampfly_types::messages::{GuidedCommand, PilotInput};

/// How a station's words come to the vehicle.
enum Way<'b> {
    /// As messages, straight to the bus.
    Direct(topics::LinkEnds<'b>),
    /// As bytes of the secure session.
    Sealed(air::Shared<'b>),
}

/// A station's end of the radio.
pub struct Radio<'b> {
    clock: Clock,
    way: Way<'b>,
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
        Self::by(clock, Way::Direct(ends), wrong)
    }

    /// One that carries the bytes of the secure session.
    pub(super) fn sealed(clock: &Clock, air: air::Shared<'b>, wrong: &Wrong) -> Self {
        Self::by(clock, Way::Sealed(air), wrong)
    }

    fn by(clock: &Clock, way: Way<'b>, wrong: &Wrong) -> Self {
        Self {
            clock: clock.clone(),
            way,
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

    /// Sends a program's command. `false` when it cannot be sent, or the vehicle's queue is full; one that is lost on the way
    /// is not noticed.
    pub fn command(&mut self, command: GuidedCommand) -> bool {
        let now = self.clock.now();
        let arrived = self.guided.pass(now, &command);
        match &mut self.way {
            Way::Direct(ends) => arrived.is_none_or(|command| ends.command_guided.publish(now, command).is_ok()),
            Way::Sealed(air) => {
                let sent = Payload::Guided(arrived.unwrap_or(command));
                air.borrow_mut().say(now, &sent, arrived.is_some())
            }
        }
    }

    /// Sends a frame of the transmitter.
    pub fn sticks(&mut self, input: &PilotInput) {
        let now = self.clock.now();
        let arrived = self.pilot.pass(now, input);
        match &mut self.way {
            Way::Direct(ends) => {
                if let Some(input) = arrived {
                    ends.command_pilot.publish(now, &input);
                }
            }
            Way::Sealed(air) => {
                // Before there is a session nothing is sent.
                air.borrow_mut().say(now, &Payload::Sticks(arrived.unwrap_or(*input)), arrived.is_some());
            }
        }
    }

    /// The newest telemetry that has arrived. Whoever flies asks for it every 20 ms.
    pub fn telemetry(&mut self) -> TelemetryFrame {
        let now = self.clock.now();
        match &mut self.way {
            Way::Direct(ends) => {
                let newest = ends.telemetry.latest();
                if let Some(frame) = newest.and_then(|frame| self.telemetry.pass(now, &frame.data)) {
                    self.frame = frame;
                }
            }
            Way::Sealed(air) => {
                let is_open = self.telemetry.pass(now, &self.frame).is_some();
                self.frame = air.borrow_mut().exchange(now, is_open);
            }
        }
        self.frame
    }
}
