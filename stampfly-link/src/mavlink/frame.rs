//! Frames, and the decoder that finds them.
//!
//! From the protocol's description, [Packet Serialization](https://mavlink.io/en/guide/serialization.html).

use super::signature::Signature;
use crate::crc16::crc16;
use crate::heard::Heard;
use core::marker::PhantomData;
use mavlink::error::ParserError;
use mavlink::{MavlinkVersion, Message};

const STX_1: u8 = 0xFE;
pub(super) const STX_2: u8 = 0xFD;
/// From the start to the payload.
const HEADER_1: usize = 6;
const HEADER_2: usize = 10;
const CRC: usize = 2;
/// Bytes that say how long a frame is: of version 2. There is no frame of fewer.
const FEWEST: usize = 3;
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

    /// The frame at the front of these bytes, whose outline this is. What its checksum says is not looked at again.
    fn of(bytes: &'f [u8], outline: Outline) -> Option<Self> {
        let Outline { version, header, crc_at, end } = outline;
        let whole = bytes.get(..end)?;
        let (sequence, system, component, id) = match (version, whole.get(..header)?) {
            (MavlinkVersion::V1, [_, _, sequence, system, component, id]) => {
                (*sequence, *system, *component, u32::from(*id))
            }
            (_, [_, _, _, _, sequence, system, component, a, b, c]) => {
                (*sequence, *system, *component, u32::from_le_bytes([*a, *b, *c, 0]))
            }
            _ => return None,
        };
        let signature = whole.get(crc_at + CRC..)?.first_chunk().map(Signature::read);
        let payload = whole.get(header..crc_at)?;
        Some(Self { version, sequence, system, component, id, payload, signature, bytes: whole })
    }
}

/// Where the parts of a frame are.
#[derive(Clone, Copy, Debug)]
struct Outline {
    version: MavlinkVersion,
    header: usize,
    crc_at: usize,
    end: usize,
}

/// What bytes begin with.
enum Begun {
    /// A whole frame with a sound checksum.
    Frame(Outline),
    /// With fewer bytes than these there is nothing more to be said.
    Needs(usize),
    /// No frame.
    Nothing,
}

impl Outline {
    fn parse<M: Message>(bytes: &[u8]) -> Begun {
        let (version, header, length, flags) = match bytes {
            [STX_1, length, ..] => (MavlinkVersion::V1, HEADER_1, *length, 0),
            [STX_2, length, flags, ..] => (MavlinkVersion::V2, HEADER_2, *length, *flags),
            [] | [STX_1 | STX_2] | [STX_2, _] => return Begun::Needs(FEWEST),
            _ => return Begun::Nothing,
        };
        // A flag that is not known changes what the frame is: the protocol says to refuse it.
        if flags & !SIGNED != 0 {
            return Begun::Nothing;
        }
        let crc_at = header + usize::from(length);
        let end = crc_at + CRC + if flags & SIGNED != 0 { Signature::LENGTH } else { 0 };
        if bytes.len() < end {
            return Begun::Needs(end);
        }
        let id = match (version, bytes) {
            (MavlinkVersion::V1, [_, _, _, _, _, id, ..]) => u32::from(*id),
            (_, [_, _, _, _, _, _, _, a, b, c, ..]) => u32::from_le_bytes([*a, *b, *c, 0]),
            _ => return Begun::Nothing,
        };
        let (checked, after) = bytes.split_at_checked(crc_at).unwrap_or_default();
        let sound = checked
            .get(1..)
            .is_some_and(|checked| after.first_chunk() == Some(&crc16(checked, M::extra_crc(id)).to_le_bytes()));
        if sound { Begun::Frame(Self { version, header, crc_at, end }) } else { Begun::Nothing }
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
    /// With fewer bytes there is nothing to be found.
    need: usize,
    /// The frame that was returned last, which is still in `heard`.
    taken: Option<Outline>,
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
        Self { heard: Heard::new(), need: 0, taken: None, dialect: PhantomData }
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
    #[inline]
    pub fn feed(&mut self, byte: u8) -> Option<MavlinkFrame<'_>> {
        self.forget();
        self.heard.push(byte);
        if self.heard.len() < self.need { None } else { self.look() }
    }

    /// Takes bytes off the front of `bytes`, as many as it needs, and returns the frame that they end. `None` when there are no more:
    /// ask until then. The same frames as of [`feed`](Self::feed), and less work for each byte.
    ///
    /// ```
    /// use stampfly_link::mavlink::dialects::common::{HEARTBEAT_DATA, MavMessage};
    /// use stampfly_link::mavlink::{LONGEST, MavlinkDecoder, MavlinkVersion, MavlinkWriter};
    /// let (mut writer, mut bytes) = (MavlinkWriter::new(1, 1), [0; LONGEST]);
    /// let message = MavMessage::HEARTBEAT(HEARTBEAT_DATA::default());
    /// let frame = writer.write(MavlinkVersion::V2, &message, &mut bytes).expect("there is room");
    /// let buffer = [b"noise", frame, frame].concat();
    /// let (mut decoder, mut rest, mut found) = (MavlinkDecoder::<MavMessage>::new(), buffer.as_slice(), 0);
    /// while decoder.read(&mut rest).is_some() {
    ///     found += 1;
    /// }
    /// assert_eq!((found, rest.len(), decoder.discarded()), (2, 0, 5));
    /// ```
    #[inline]
    pub fn read(&mut self, bytes: &mut &[u8]) -> Option<MavlinkFrame<'_>> {
        self.forget();
        while !bytes.is_empty() {
            if self.heard.is_empty() {
                let begins = bytes.iter().position(|byte| matches!(*byte, STX_1 | STX_2)).unwrap_or(bytes.len());
                self.heard.skip(begins);
                *bytes = bytes.get(begins..).unwrap_or_default();
                self.need = FEWEST;
            }
            // What was heard before may be a frame already; one more byte shows it.
            self.heard.fill(self.need.saturating_sub(self.heard.len()).max(1), bytes);
            if self.heard.len() >= self.need && self.find() {
                break;
            }
        }
        self.frame()
    }

    /// The frame that was returned last is not needed any more.
    #[inline]
    fn forget(&mut self) {
        if let Some(outline) = self.taken.take() {
            self.heard.take(outline.end);
            self.need = 0;
        }
    }

    fn look(&mut self) -> Option<MavlinkFrame<'_>> {
        self.find();
        self.frame()
    }

    #[inline]
    fn frame(&self) -> Option<MavlinkFrame<'_>> {
        self.taken.and_then(|outline| MavlinkFrame::of(self.heard.bytes(), outline))
    }

    /// Looks for a frame, and gives up what is before it. Says whether there is one.
    fn find(&mut self) -> bool {
        loop {
            match Outline::parse::<M>(self.heard.bytes()) {
                Begun::Frame(outline) => {
                    self.taken = Some(outline);
                    return true;
                }
                Begun::Needs(need) => {
                    self.need = need;
                    return false;
                }
                Begun::Nothing => {
                    let later = self.heard.bytes().iter().skip(1).position(|byte| matches!(*byte, STX_1 | STX_2));
                    self.heard.discard(later.map_or(self.heard.len(), |later| later + 1));
                }
            }
        }
    }
}
