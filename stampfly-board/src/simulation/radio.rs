//! The radio between the vehicle and whoever flies it, with what can go wrong on it.

use super::air;
use super::faults::Wrong;
use crate::link::Link;
use crate::messages::TelemetryFrame;
use crate::topics::{self, Id};
use stampfly_link::Session;
use stampfly_link::secure::{Guarded, Payload, Policy};
use stampfly_sim::fault::Line;
use stampfly_sim::time::Clock;
use stampfly_types::messages::{GuidedCommand, PilotInput};
use std::boxed::Box;

/// How a station's words come to the vehicle.
enum Way<'b> {
    /// As messages, straight to the bus; beside it, frames of whoever has a key, if there is one.
    Direct(Box<Link<'b>>),
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
        let session = Session::new(air::VEHICLE, 1, None);
        let link = Link::new(Guarded::new(None, session, Policy::default()), ends);
        Self::by(clock, Way::Direct(Box::new(link)), wrong)
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

    /// The firmware's end of the radio, which also hears frames of stations with this key. `None` where a simulated station has it.
    pub(super) fn link(&mut self) -> Option<&mut Link<'b>> {
        match &mut self.way {
            Way::Direct(link) => Some(link),
            Way::Sealed(_) => None,
        }
    }

    /// Whether frames get through now.
    pub(super) fn is_open(&mut self) -> bool {
        self.telemetry.pass(self.clock.now(), &self.frame).is_some()
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
            Way::Direct(link) => arrived.is_none_or(|command| link.command(now, command)),
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
            Way::Direct(link) => {
                if let Some(input) = arrived {
                    link.sticks(now, &input);
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
            Way::Direct(link) => {
                let newest = link.ends.telemetry.latest();
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
