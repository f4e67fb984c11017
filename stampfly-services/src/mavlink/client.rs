//! One client: what it was heard to send, what it wants and how often.

use super::heard::Heard;
use super::identity::{AUTOPILOT, Own};
use super::pulse::Pulse;
use super::said::Said;
use super::streams::STREAMS;
use super::unreadable::Unreadable;
use super::unserved::Told;
use crate::refusal::Connection;
use crate::view::View;
use stampfly_link::mavlink::MessageData as _;
use stampfly_link::mavlink::dialects::common::{HEARTBEAT_DATA, MavMessage, MavSeverity, STATUSTEXT_DATA};
use stampfly_link::mavlink::signing::{Signer, SigningKey, Untrusted, Verifier};
use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkWriter, Tunnel};
use stampfly_types::{Duration, Instant};

/// A client whose clock is behind is told the vehicle's time so often.
const TIME: Duration = Duration::from_secs(1);
/// Characters of a text for people in one message.
const PIECE: usize = 50;

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
pub(super) enum Fed {
    /// A message of this system and component that is for a vehicle.
    Message([u8; 2], Heard),
    /// A message of this system and component that the dialect cannot read, but that wants an
    /// answer.
    Unreadable([u8; 2], Unreadable),
    /// Bytes of another protocol, of this system and component.
    Tunnel([u8; 2], Tunnel),
    /// A frame that is not signed as it must be.
    Untrusted(Untrusted),
    /// A frame of the vehicle's own.
    Own,
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
    /// The number of its connection, once it has said something.
    pub connection: Option<Connection>,
    pub heard: Instant,
    pub pulse: Pulse,
    /// It is sent to although it says nothing.
    pub stays: bool,
    /// It has sent a frame that was believed.
    pub believed: bool,
    now: Instant,
    /// When it was told the vehicle's time.
    told: Option<Instant>,
    decoder: MavlinkDecoder<MavMessage>,
    writer: MavlinkWriter,
    /// Frames to it are signed, and its own must be.
    signer: Option<Signer>,
    /// One a line of [`STREAMS`].
    pub due: [Due; STREAMS.len()],
    /// The next parameter of a list that was asked for.
    pub next_parameter: Option<usize>,
    /// What it was told of that is not done.
    pub told_of: Told,
    /// Where a stream of targets last sent the vehicle, north, east, down, heading.
    pub target: Option<[f32; 4]>,
}

impl<C> Client<C> {
    pub fn new(system: u8, id: C, now: Instant, stays: bool, guard: Option<&Guard>) -> Self {
        let due = STREAMS.map(|stream| Due { every: stream.every, next: now });
        Self {
            id,
            connection: None,
            heard: now,
            pulse: Pulse::new(now),
            stays,
            believed: false,
            now,
            told: None,
            decoder: MavlinkDecoder::new(),
            writer: MavlinkWriter::new(system, AUTOPILOT),
            signer: guard.map(|guard| Signer::new(guard.key.clone(), 0, guard.epoch)),
            due,
            next_parameter: None,
            told_of: Told::NEVER,
            target: None,
        }
    }

    /// What is said from now on is said at this instant, and signed later than what was believed.
    pub fn at(&mut self, now: Instant, guard: Option<&Guard>) {
        self.now = now;
        if let Some((signer, guard)) = self.signer.as_mut().zip(guard) {
            signer.not_before(guard.verifier.time());
        }
    }

    /// The second in which something is said.
    pub const fn second(&self) -> u64 {
        self.now.as_micros() / 1_000_000
    }

    /// May it be sent to? Whoever has to sign and has not is sent nothing that it did not connect
    /// for.
    pub const fn is_served(&self) -> bool {
        self.stays || self.believed
    }

    /// The time of the last signature to it.
    pub fn signed(&self) -> Option<u64> {
        self.signer.as_ref().map(Signer::time)
    }

    /// May it be told the vehicle's time? Once a second.
    pub fn may_be_told(&mut self, now: Instant) -> bool {
        let may = self.told.is_none_or(|at| now.since(at) >= TIME);
        if may {
            self.told = Some(now);
        }
        may
    }

    /// Takes a byte. Returns the message that it ends. What is no message of the dialect and wants
    /// no answer is passed over.
    pub fn feed(&mut self, byte: u8, own: u8, guard: Option<&mut Guard>) -> Option<Fed> {
        let frame = self.decoder.feed(byte)?;
        // What the vehicle itself has said, and signed, comes back from a router, or from one who
        // has no key of his own.
        if [frame.system, frame.component] == [own, AUTOPILOT] {
            return Some(Fed::Own);
        }
        if self.signer.is_some() {
            let judged = guard.map_or(Err(Untrusted::Unsigned), |guard| guard.verifier.verify(&frame));
            if let Err(why) = judged {
                return Some(Fed::Untrusted(why));
            }
        }
        (self.believed, self.heard) = (true, self.now);
        self.pulse.hear(self.now, frame.id == HEARTBEAT_DATA::ID);
        let sender = [frame.system, frame.component];
        if frame.id == Tunnel::ID {
            return Some(Fed::Tunnel(sender, Tunnel::read(frame.payload)?));
        }
        Some(match Heard::read(&frame)? {
            Ok(message) => Fed::Message(sender, message),
            Err(message) => Fed::Unreadable(sender, message),
        })
    }

    /// Sends a message. In version 2, which every program reads that is not older than 2017.
    pub fn send(&mut self, message: &Said, put: Put<'_, C>) {
        self.send_payload(message.id, message.payload(), put);
    }

    /// Says a sentence of any length: in pieces of 50 bytes, which a station that knows them puts
    /// together again.
    pub fn say(&mut self, severity: MavSeverity, sentence: &str, put: Put<'_, C>) {
        let pieces = sentence.as_bytes().chunks(PIECE);
        // A number that the last sentence did not have; zero is for one of a single piece.
        let id = if pieces.len() > 1 { (self.now.as_micros() / 1_000) as u16 | 1 } else { 0 };
        for (chunk_seq, piece) in (0..).zip(pieces) {
            let mut text = [0; PIECE];
            text.iter_mut().zip(piece).for_each(|(to, from)| *to = *from);
            self.send(&STATUSTEXT_DATA { severity, text: text.into(), id, chunk_seq }.into(), put);
        }
    }

    /// Sends a message by its number and fields.
    // Called wherever something is said: its room for a frame is on the stack once.
    #[inline(never)]
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
