//! Frames, and the decoder that finds them.
//!
//! From the protocol's description, [Packet Serialization](https://mavlink.io/en/guide/serialization.html).

use super::signature::Signature;
use crate::heard::Heard;
use core::marker::PhantomData;
use mavlink::error::ParserError;
use mavlink::{MavlinkVersion, Message, calculate_crc};

const STX_1: u8 = 0xFE;
pub(super) const STX_2: u8 = 0xFD;
/// From the start to the payload.
const HEADER_1: usize = 6;
const HEADER_2: usize = 10;
const CRC: usize = 2;
/// A frame with this flag ends with a signature.
pub(super) const SIGNED: u8 = 0x01;
/// Bytes of the longest frame: of version 2, with a signature.
pub const LONGEST: usize = HEADER_2 + 255 + CRC + Signature::LENGTH;

/// A frame whose checksum is right for its dialect. Not yet believed: see [`signing`](super::signing).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MavlinkFrame<'f> {
    /// Which of the two it is written in.
    pub version: MavlinkVersion,
    /// Counts the frames of one sender.
    pub sequence: u8,
    /// The sending system: a vehicle, a ground station (255 by custom).
    pub system: u8,
    /// The sending part of that system; 1 is an autopilot.
    pub component: u8,
    /// Which message.
    pub id: u32,
    /// The message, without the zeros at its end in version 2.
    pub payload: &'f [u8],
    /// How it is signed, if it is.
    pub signature: Option<Signature>,
    /// Of the whole frame.
    pub(super) bytes: &'f [u8],
}

impl<'f> MavlinkFrame<'f> {
    /// The message in it.
    ///
    /// # Errors
    /// When the dialect has no such message, or a field of it has a value that it must not have.
    pub fn message<M: Message>(&self) -> Result<M, ParserError> {
        M::parse(self.version, self.id, self.payload)
    }

    /// All of it, as it was sent.
    #[must_use]
    pub const fn bytes(&self) -> &'f [u8] {
        self.bytes
    }

    /// A frame that begins here: `None` when none does, `Some(Err(()))` when more bytes are needed.
    fn parse<M: Message>(bytes: &'f [u8]) -> Option<Result<Self, ()>> {
        let Some((start, rest)) = bytes.split_first() else { return Some(Err(())) };
        let (version, header) = match *start {
            STX_1 => (MavlinkVersion::V1, HEADER_1),
            STX_2 => (MavlinkVersion::V2, HEADER_2),
            _ => return None,
        };
        let signed = version == MavlinkVersion::V2 && rest.get(1).is_some_and(|flags| flags & SIGNED != 0);
        // A flag that is not known changes what the frame is: the protocol says to refuse it.
        if version == MavlinkVersion::V2 && rest.get(1).is_some_and(|flags| flags & !SIGNED != 0) {
            return None;
        }
        let Some(head) = bytes.get(..header) else { return Some(Err(())) };
        let length = usize::from(*rest.first()?);
        let crc_at = header + length;
        let end = crc_at + CRC + if signed { Signature::LENGTH } else { 0 };
        let Some(whole) = bytes.get(..end) else { return Some(Err(())) };
        let (sequence, system, component, id) = match (version, head) {
            (MavlinkVersion::V1, [_, _, sequence, system, component, id]) => {
                (*sequence, *system, *component, u32::from(*id))
            }
            (_, [_, _, _, _, sequence, system, component, a, b, c]) => {
                (*sequence, *system, *component, u32::from_le_bytes([*a, *b, *c, 0]))
            }
            _ => return None,
        };
        let (checked, after) = whole.split_at_checked(crc_at)?;
        let (crc, signature) = after.split_first_chunk::<CRC>()?;
        if calculate_crc(checked.get(1..)?, M::extra_crc(id)) != u16::from_le_bytes(*crc) {
            return None;
        }
        let signature = signature.first_chunk().map(Signature::read);
        let payload = checked.get(header..)?;
        Some(Ok(Self { version, sequence, system, component, id, payload, signature, bytes: whole }))
    }
}

/// Finds the frames of a dialect among bytes: a serial line, datagrams, a TCP connection.
///
/// A message that the dialect does not have cannot be checked, and is passed over. It begins anew after whatever is no frame, and
/// costs a bounded time a byte.
///
/// ```
/// use stampfly_link::mavlink::{MavlinkDecoder, MavlinkVersion, MavlinkWriter};
/// use stampfly_link::mavlink::dialects::common::{HEARTBEAT_DATA, MavMessage};
///
/// let mut writer = MavlinkWriter::new(1, 1);
/// let heartbeat = MavMessage::HEARTBEAT(HEARTBEAT_DATA::default());
/// let mut bytes = [0; stampfly_link::mavlink::LONGEST];
/// let sent = writer.write(MavlinkVersion::V2, &heartbeat, &mut bytes).unwrap_or_default();
///
/// let mut decoder = MavlinkDecoder::<MavMessage>::new();
/// let heard = [b"noise", sent].concat().iter().find_map(|byte| {
///     decoder.feed(*byte).map(|frame| (frame.system, frame.message::<MavMessage>()))
/// });
/// assert!(matches!(heard, Some((1, Ok(MavMessage::HEARTBEAT(_))))));
/// assert_eq!(decoder.discarded(), 5);
/// ```
#[derive(Clone, Debug)]
pub struct MavlinkDecoder<M> {
    heard: Heard<LONGEST>,
    /// Of the frame that was returned last, which is still in `heard`.
    taken: usize,
    dialect: PhantomData<fn() -> M>,
}

impl<M> Default for MavlinkDecoder<M> {
    fn default() -> Self {
        Self::new()
    }
}

impl<M> MavlinkDecoder<M> {
    /// Nothing heard yet.
    #[must_use]
    pub const fn new() -> Self {
        Self { heard: Heard::new(), taken: 0, dialect: PhantomData }
    }

    /// Bytes so far that were part of no frame. Wraps around.
    #[must_use]
    pub const fn discarded(&self) -> u32 {
        self.heard.discarded()
    }
}

impl<M: Message> MavlinkDecoder<M> {
    /// Takes a byte. Returns the frame that it ends.
    ///
    /// After a byte that shows that there was no frame, what was heard meanwhile may hold a whole one: it is returned with the
    /// byte that follows.
    pub fn feed(&mut self, byte: u8) -> Option<MavlinkFrame<'_>> {
        self.heard.take(core::mem::take(&mut self.taken));
        self.heard.push(byte);
        loop {
            match MavlinkFrame::parse::<M>(self.heard.bytes()) {
                Some(Err(())) => return None,
                None => {
                    let later = self.heard.bytes().iter().skip(1).position(|byte| matches!(*byte, STX_1 | STX_2));
                    self.heard.discard(later.map_or(self.heard.len(), |later| later + 1));
                }
                Some(Ok(frame)) => {
                    self.taken = frame.bytes.len();
                    // Once more, because the borrow of a loop's turn does not outlive it.
                    return MavlinkFrame::parse::<M>(self.heard.bytes())?.ok();
                }
            }
        }
    }
}
