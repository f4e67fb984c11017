//! What a station of this family says to its vehicle over MAVLink: the payloads of the [secure link](stampfly_link::secure), in `TUNNEL`.
//!
//! MAVLink's own messages are for any ground station. Topics by their number, words of every message, the console's lines, and parameters with their whole
//! names are not among them. A payload is the same on the radio and here, but not sealed: this is for a cable.
//!
//! | offset | type | field |
//! |---|---|---|
//! | 0 | u16 | [fingerprint] of the vehicle's tables: another one's places mean something else |
//! | 2 | u16 | number of the question, which its answer repeats; of samples, of the sample |
//! | 4 | u8 | kind, as in [`Payload`] |
//! | 5 | u8 | place of this part from 0; bit 7 is set in the last, bit 6 where it says when |
//! | 6 | u32 | with bit 6: when it was said, by the vehicle's clock, ms |
//! | 6 or 10 | … | body, as its kind has it; a longer one goes on in the next part |
//!
//! `payload_type` is [`TYPE`], among those that anybody may use. Little-endian, at most 128 bytes.

use heapless::Vec;
use stampfly_bus::TopicInfo;
use stampfly_link::secure::{Kind, Payload};
use stampfly_param::Parameters;

/// The type of our tunnels.
pub const TYPE: u16 = 0xF1F5;
/// Bytes of a tunnel.
pub const TUNNEL: usize = 128;
const HEADER: usize = 6;
/// Bytes of a body in one part.
pub const PART: usize = TUNNEL - HEADER - DATE;
/// Parts of a body, at most.
const PARTS: usize = 3;
/// Bytes of a body.
pub const BODY: usize = PARTS * PART;
const LAST: u8 = 0x80;
const DATED: u8 = 0x40;
/// Bytes of an instant.
const DATE: usize = 4;

/// Two ends that mean the same by the places of topics and parameters have the same.
#[must_use]
pub fn fingerprint(topics: &[TopicInfo], parameters: &dyn Parameters) -> u16 {
    // FNV-1a, folded.
    let mix = |hash: u32, byte: u8| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193);
    let mut hash = 0x811C_9DC5;
    for topic in topics {
        hash = topic.name.bytes().fold(hash, mix);
        hash = mix(hash, topic.words as u8);
    }
    let names = (0..).map_while(|index| parameters.describe(index).map(|info| info.name));
    for name in names {
        hash = mix(name.bytes().fold(hash, mix), 0);
    }
    (hash ^ (hash >> 16)) as u16
}

/// The outside of one part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Envelope {
    /// Of the sender's tables.
    pub table: u16,
    /// Of the question.
    pub number: u16,
    /// What the body is.
    pub kind: Kind,
    /// When a station has said it, by the vehicle's clock as far as it knows that, ms. A vehicle says nothing of it.
    pub said: Option<u32>,
    /// Which part.
    place: u8,
    is_last: bool,
}

impl Envelope {
    /// Hands every part of a payload to `put`. A value that must not be used is not sent: `false`.
    pub fn write(
        table: u16,
        number: u16,
        said: Option<u32>,
        payload: &Payload<'_>,
        put: &mut dyn FnMut(&[u8]),
    ) -> bool {
        let mut body = [0; BODY];
        let Ok(length) = payload.encode(&mut body) else { return false };
        let mut rest = body.get(..length).unwrap_or_default();
        for place in 0..PARTS as u8 {
            let (part, more) = rest.split_at_checked(PART).unwrap_or((rest, &[]));
            rest = more;
            let last = if rest.is_empty() { LAST } else { 0 };
            let dated = if said.is_some() { DATED } else { 0 };
            let ([t0, t1], [n0, n1]) = (table.to_le_bytes(), number.to_le_bytes());
            let mut bytes = Vec::<u8, TUNNEL>::new();
            // There is room for all of it.
            _ = bytes.extend_from_slice(&[t0, t1, n0, n1, payload.kind() as u8, place | last | dated]);
            _ = said.is_none_or(|said| bytes.extend_from_slice(&said.to_le_bytes()).is_ok());
            _ = bytes.extend_from_slice(part);
            put(&bytes);
            if rest.is_empty() {
                break;
            }
        }
        true
    }

    /// Reads one part, and returns its body with it.
    #[must_use]
    pub fn read(bytes: &[u8]) -> Option<(Self, &[u8])> {
        let (&[t0, t1, n0, n1, kind, part], body) = bytes.split_first_chunk::<HEADER>()?;
        let kind = Kind::ALL.into_iter().find(|known| *known as u8 == kind)?;
        let (table, number) = (u16::from_le_bytes([t0, t1]), u16::from_le_bytes([n0, n1]));
        let (place, is_last) = (part & !(LAST | DATED), part & LAST != 0);
        let (said, body) = match part & DATED {
            0 => (None, body),
            _ => {
                let (said, body) = body.split_first_chunk::<DATE>()?;
                (Some(u32::from_le_bytes(*said)), body)
            }
        };
        (body.len() <= PART).then_some((Self { table, number, kind, said, place, is_last }, body))
    }
}

/// Puts parts together.
///
/// ```
/// use stampfly_link::secure::Payload;
/// use stampfly_services::cable::{Assembly, Envelope};
/// let text = "a".repeat(150);
/// let (mut assembly, mut heard) = (Assembly::default(), 0);
/// let said = Payload::Reply { text: &text, last: true };
/// Envelope::write(7, 1, None, &said, &mut |part| {
///     if let Some((envelope, payload)) = assembly.feed(part) {
///         assert_eq!((envelope.table, envelope.number, payload), (7, 1, said));
///         heard += 1;
///     }
/// });
/// assert_eq!(heard, 1);
/// ```
#[derive(Clone, Debug, Default)]
pub struct Assembly {
    body: Vec<u8, BODY>,
    /// The part before.
    before: Option<Envelope>,
}

impl Assembly {
    /// Takes a part. Returns what it completes; what is no payload is passed over.
    pub fn feed(&mut self, bytes: &[u8]) -> Option<(Envelope, Payload<'_>)> {
        let before = self.before.take();
        let (envelope, part) = Envelope::read(bytes)?;
        let follows = before.is_some_and(|before| {
            Envelope { place: before.place + 1, is_last: envelope.is_last, ..before } == envelope
        });
        match envelope.place {
            0 => self.body.clear(),
            _ if follows => {}
            _ => return None,
        }
        self.body.extend_from_slice(part).ok()?;
        if !envelope.is_last {
            self.before = Some(envelope);
            return None;
        }
        Some((envelope, Payload::decode(envelope.kind, &self.body)?))
    }
}
