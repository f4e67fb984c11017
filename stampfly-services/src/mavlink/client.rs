//! One client: what it was heard to send, what it wants and how often.

use super::identity::{AUTOPILOT, Own};
use super::streams::STREAMS;
use super::unreadable::Unreadable;
use crate::view::View;
use stampfly_link::mavlink::dialects::common::MavMessage;
use stampfly_link::mavlink::signing::{Signer, SigningKey, Verifier};
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

/// What a byte has ended.
#[expect(clippy::large_enum_variant, reason = "it is looked at once and gone, and nothing here allocates")]
pub(super) enum Fed {
    /// A message of this system.
    Message(u8, MavMessage),
    /// A message of this system that the dialect cannot read, but that wants an answer.
    Unreadable(u8, Unreadable),
    /// A frame that is not signed as it must be.
    Untrusted,
}

/// Who may be believed, when frames must be signed.
#[derive(Clone, Debug)]
pub(super) struct Guard {
    pub key: SigningKey,
    /// The signature time at the clock's zero.
    pub epoch: u64,
    pub verifier: Verifier,
}

/// One client.
#[derive(Clone, Debug)]
pub(super) struct Client<C> {
    pub id: C,
    pub heard: Instant,
    /// It is sent to although it says nothing.
    pub stays: bool,
    /// It has sent a frame that was believed.
    pub believed: bool,
    now: Instant,
    decoder: MavlinkDecoder<MavMessage>,
    writer: MavlinkWriter,
    /// Frames to it are signed, and its own must be.
    signer: Option<Signer>,
    /// One a line of [`STREAMS`].
    pub due: [Due; STREAMS.len()],
    /// The next parameter of a list that was asked for.
    pub next_parameter: Option<usize>,
    /// Where a stream of targets last sent the vehicle, north, east, down, heading.
    pub target: Option<[f32; 4]>,
}

impl<C> Client<C> {
    pub fn new(system: u8, id: C, now: Instant, stays: bool, guard: Option<&Guard>) -> Self {
        let due = STREAMS.map(|stream| Due { every: stream.every, next: now });
        Self {
            id,
            heard: now,
            stays,
            believed: false,
            now,
            decoder: MavlinkDecoder::new(),
            writer: MavlinkWriter::new(system, AUTOPILOT),
            signer: guard.map(|guard| Signer::new(guard.key.clone(), 0, guard.epoch)),
            due,
            next_parameter: None,
            target: None,
        }
    }

    /// What is said from now on is said at this instant.
    pub const fn at(&mut self, now: Instant) {
        self.now = now;
    }

    /// May it be sent to? Whoever has to sign and has not is sent nothing that it did not connect for.
    pub const fn is_served(&self) -> bool {
        self.stays || self.believed
    }

    /// Takes a byte. Returns the message that it ends. What is no message of the dialect and wants no answer is passed over.
    pub fn feed(&mut self, byte: u8, guard: Option<&mut Guard>) -> Option<Fed> {
        let frame = self.decoder.feed(byte)?;
        if self.signer.is_some() && guard.is_none_or(|guard| guard.verifier.verify(&frame).is_err()) {
            return Some(Fed::Untrusted);
        }
        (self.believed, self.heard) = (true, self.now);
        match frame.message() {
            Ok(message) => Some(Fed::Message(frame.system, message)),
            Err(_) => Some(Fed::Unreadable(frame.system, Unreadable::of(frame.id, frame.payload)?)),
        }
    }

    /// Sends a message. In version 2, which every program reads that is not older than 2017.
    pub fn send(&mut self, message: &MavMessage, put: Put<'_, C>) {
        let mut buffer = [0; LONGEST];
        let frame = match &mut self.signer {
            Some(signer) => self.writer.write_signed(self.now, message, signer, &mut buffer),
            None => self.writer.write(MavlinkVersion::V2, message, &mut buffer),
        };
        if let Some(frame) = frame {
            put(&self.id, frame);
        }
    }

    /// Sends a message by its number and fields.
    pub fn send_payload(&mut self, id: u32, payload: &[u8], put: Put<'_, C>) {
        let mut buffer = [0; LONGEST];
        let frame = match &mut self.signer {
            Some(signer) => self.writer.write_payload_signed::<MavMessage>(self.now, id, payload, signer, &mut buffer),
            None => self.writer.write_payload::<MavMessage>(id, payload, &mut buffer),
        };
        if let Some(frame) = frame {
            put(&self.id, frame);
        }
    }

    /// Sends what is due.
    pub fn send_due(&mut self, now: Instant, own: &Own, view: &View<'_>, put: Put<'_, C>) {
        for (index, stream) in STREAMS.iter().enumerate() {
            let Some(due) = self.due.get_mut(index) else { continue };
            let Some(period) = due.every.filter(|_| now >= due.next) else { continue };
            // From the plan, so that late calls do not add up; but never two at once.
            let planned = due.next + period;
            due.next = if planned > now { planned } else { now + period };
            if let Some(message) = (stream.make)(now, own, view) {
                self.send(&message, put);
            }
        }
    }
}
