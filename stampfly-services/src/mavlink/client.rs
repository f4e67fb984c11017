//! One client: what it was heard to send, what it wants and how often.

use super::identity::{AUTOPILOT, Identity};
use super::streams::STREAMS;
use crate::view::View;
use stampfly_link::mavlink::dialects::common::MavMessage;
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkVersion, MavlinkWriter};
use stampfly_types::{Duration, Instant};

/// Where frames go.
pub(super) type Put<'p, C> = &'p mut dyn FnMut(&C, &[u8]);

/// When a stream's next message is due.
#[derive(Clone, Copy, Debug)]
pub(super) struct Due {
    /// Between two; `None` for never.
    pub every: Option<Duration>,
    pub next: Instant,
}

/// One client.
#[derive(Clone, Debug)]
pub(super) struct Client<C> {
    pub id: C,
    pub heard: Instant,
    /// It is sent to although it says nothing.
    pub stays: bool,
    decoder: MavlinkDecoder<MavMessage>,
    writer: MavlinkWriter,
    /// One a line of [`STREAMS`].
    pub due: [Due; STREAMS.len()],
    /// The next parameter of a list that was asked for.
    pub next_parameter: Option<usize>,
    /// Where a stream of targets last sent the vehicle, north, east, down, heading.
    pub target: Option<[f32; 4]>,
}

impl<C> Client<C> {
    pub fn new(system: u8, id: C, now: Instant, stays: bool) -> Self {
        let due = STREAMS.map(|stream| Due { every: stream.every, next: now });
        Self {
            id,
            heard: now,
            stays,
            decoder: MavlinkDecoder::new(),
            writer: MavlinkWriter::new(system, AUTOPILOT),
            due,
            next_parameter: None,
            target: None,
        }
    }

    /// Takes a byte. Returns the message that it ends, and the system that sent it. What is no message of the dialect is passed
    /// over.
    pub fn feed(&mut self, byte: u8) -> Option<(u8, MavMessage)> {
        let frame = self.decoder.feed(byte)?;
        Some((frame.system, frame.message().ok()?))
    }

    /// Sends a message. In version 2, which every program reads that is not older than 2017.
    pub fn send(&mut self, message: &MavMessage, put: Put<'_, C>) {
        let mut buffer = [0; LONGEST];
        if let Some(frame) = self.writer.write(MavlinkVersion::V2, message, &mut buffer) {
            put(&self.id, frame);
        }
    }

    /// Sends what is due.
    pub fn send_due(&mut self, now: Instant, identity: &Identity, view: &View<'_>, put: Put<'_, C>) {
        for (index, stream) in STREAMS.iter().enumerate() {
            let Some(due) = self.due.get_mut(index) else { continue };
            let Some(period) = due.every.filter(|_| now >= due.next) else { continue };
            // From the plan, so that late calls do not add up; but never two at once.
            let planned = due.next + period;
            due.next = if planned > now { planned } else { now + period };
            if let Some(message) = (stream.make)(now, identity, view) {
                self.send(&message, put);
            }
        }
    }
}
