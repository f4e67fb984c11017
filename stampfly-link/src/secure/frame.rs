//! A frame's outside: lengths, kinds, the header in the clear, the nonce.

use super::cipher::{NONCE, Secret, TAG};
use super::clock::Tick;
use super::refused::{Refused, SealError};

/// Version of the format.
pub const VERSION: u8 = 1;
/// Length of what is in the clear, bytes.
pub const HEADER: usize = 11;
/// Length of the time that every frame begins with inside, bytes.
const STAMP: usize = 4;
/// Length of a frame without a body, bytes. Every unauthenticated packet of this crate's ESP-NOW link is shorter.
pub const MIN_FRAME: usize = HEADER + STAMP + TAG;
/// Length of the longest frame, bytes: what an ESP-NOW frame of its first version carries.
pub const MAX_FRAME: usize = 250;
/// Length of the longest body, bytes.
pub const MAX_BODY: usize = MAX_FRAME - MIN_FRAME;

/// Copies bytes to the front of a frame's room. `None` when they are too many.
#[must_use]
pub fn put<'r>(room: &'r mut [u8; MAX_FRAME], bytes: &[u8]) -> Option<&'r [u8]> {
    let place = room.get_mut(..bytes.len())?;
    // As long as the bytes; spelled so that no panic is linked for other lengths.
    place.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
    Some(place)
}

/// Which end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sender {
    Station = 1,
    Vehicle = 2,
}

/// What is in a frame. Bit 7 is set in what a vehicle sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kind {
    /// Handshake: a station answers an announcement.
    Join = 0x01,
    /// Handshake: a station has heard the vehicle's welcome.
    Ready = 0x02,
    /// Sticks and switches.
    Sticks = 0x10,
    /// A program's command.
    Guided = 0x11,
    /// Motors off now.
    Kill = 0x12,
    /// A program's command, with its number.
    Numbered = 0x13,
    /// A parameter is asked for.
    ReadParameter = 0x20,
    /// A parameter is to be changed.
    WriteParameter = 0x21,
    /// A line for the console.
    Line = 0x30,
    /// A line for the console, with its number.
    Question = 0x31,
    /// Messages of a topic are to be sent.
    Watch = 0x40,
    /// The flight record is to be sent.
    Record = 0x41,
    /// Handshake: a vehicle offers a session.
    Announcement = 0x81,
    /// Handshake: a vehicle has taken a station in.
    Welcome = 0x82,
    /// The vehicle's state.
    Telemetry = 0x90,
    /// The value of a parameter.
    Parameter = 0xA0,
    /// A part of the console's answer.
    Reply = 0xB0,
    /// A part of the answer to a question.
    Part = 0xB1,
    /// A message of a topic.
    Sample = 0xC0,
    /// A chunk of the flight record.
    Chunk = 0xC1,
    /// What places in the vehicle's tables mean.
    Tables = 0xC2,
    /// A frame of the station has been taken, or what is in it refused.
    Acknowledgement = 0xD0,
    /// Why what is in a frame of the station was refused.
    Refusal = 0xD1,
    /// What was asked of the vehicle, and by whom.
    Notice = 0xD2,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 24] = [
        Self::Join,
        Self::Ready,
        Self::Sticks,
        Self::Guided,
        Self::Kill,
        Self::Numbered,
        Self::ReadParameter,
        Self::WriteParameter,
        Self::Line,
        Self::Question,
        Self::Watch,
        Self::Record,
        Self::Announcement,
        Self::Welcome,
        Self::Telemetry,
        Self::Parameter,
        Self::Reply,
        Self::Part,
        Self::Sample,
        Self::Chunk,
        Self::Tables,
        Self::Acknowledgement,
        Self::Refusal,
        Self::Notice,
    ];

    /// Does the vehicle send it, and not the station?
    #[must_use]
    pub const fn is_from_vehicle(self) -> bool {
        self as u8 & 0x80 != 0
    }

    pub(super) fn is_from(self, sender: Sender) -> bool {
        self.is_from_vehicle() == (sender == Sender::Vehicle)
    }
}

/// What is in the clear.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    pub kind: Kind,
    pub key_id: u8,
    pub session: u32,
    pub counter: u32,
}

impl Header {
    pub fn to_bytes(self) -> [u8; HEADER] {
        let [s0, s1, s2, s3] = self.session.to_le_bytes();
        let [c0, c1, c2, c3] = self.counter.to_le_bytes();
        [VERSION, self.kind as u8, self.key_id, s0, s1, s2, s3, c0, c1, c2, c3]
    }

    /// Session and counter, as bytes: in a handshake, the sender's random number.
    pub const fn number(&self) -> [u8; 8] {
        let [a, b, c, d] = self.session.to_le_bytes();
        let [e, f, g, h] = self.counter.to_le_bytes();
        [a, b, c, d, e, f, g, h]
    }

    /// A handshake's header, with this random number.
    pub const fn of_number(kind: Kind, key_id: u8, [a, b, c, d, e, f, g, h]: [u8; 8]) -> Self {
        let (session, counter) = (u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h]));
        Self { kind, key_id, session, counter }
    }

    /// Looks at what costs nothing, for an end that hears this sender with this key.
    pub fn read(frame: &[u8], sender: Sender, key_id: u8) -> Result<Self, Refused> {
        if !(MIN_FRAME..=MAX_FRAME).contains(&frame.len()) {
            return Err(Refused::Length);
        }
        let &[version, kind, key, s0, s1, s2, s3, c0, c1, c2, c3] = frame.first_chunk().ok_or(Refused::Length)?;
        if version != VERSION {
            return Err(Refused::Version);
        }
        let kind = Kind::ALL.into_iter().find(|known| *known as u8 == kind && known.is_from(sender));
        let kind = kind.ok_or(Refused::Kind)?;
        if key != key_id {
            return Err(Refused::KeyId);
        }
        let (session, counter) = (u32::from_le_bytes([s0, s1, s2, s3]), u32::from_le_bytes([c0, c1, c2, c3]));
        Ok(Self { kind, key_id, session, counter })
    }

    fn nonce(&self, sender: Sender) -> [u8; NONCE] {
        let [a, b, c, d, e, f, g, h] = self.number();
        [sender as u8, 0, 0, 0, a, b, c, d, e, f, g, h]
    }

    /// Seals a frame in the room: what `write` leaves in the body that it is given, and says the length of. Returns the
    /// length of the frame.
    pub fn seal(
        self,
        secret: &Secret,
        sender: Sender,
        tick: Tick,
        room: &mut [u8],
        write: impl FnOnce(&mut [u8]) -> Result<usize, SealError>,
    ) -> Result<usize, SealError> {
        let (head, rest) = room.split_first_chunk_mut::<HEADER>().ok_or(SealError::Length)?;
        *head = self.to_bytes();
        let (stamp, body) = rest.split_first_chunk_mut::<STAMP>().ok_or(SealError::Length)?;
        *stamp = tick.0.to_le_bytes();
        let space = body.len().saturating_sub(TAG).min(MAX_BODY);
        let length = write(body.get_mut(..space).ok_or(SealError::Length)?)?;
        let text = rest.get_mut(..STAMP + length).ok_or(SealError::Length)?;
        let tag = secret.seal(self.nonce(sender), head, text).ok_or(SealError::Length)?;
        let place = rest.get_mut(STAMP + length..).and_then(|rest| rest.first_chunk_mut::<TAG>());
        *place.ok_or(SealError::Length)? = tag;
        Ok(HEADER + STAMP + length + TAG)
    }

    /// Opens a frame in place: when it was sealed, and its body.
    pub fn open<'f>(&self, secret: &Secret, sender: Sender, frame: &'f mut [u8]) -> Result<(Tick, &'f [u8]), Refused> {
        let (head, rest) = frame.split_first_chunk_mut::<HEADER>().ok_or(Refused::Length)?;
        let (text, tag) = rest.split_last_chunk_mut::<TAG>().ok_or(Refused::Length)?;
        if !secret.open(self.nonce(sender), head, text, *tag) {
            return Err(Refused::Tag);
        }
        let (stamp, body) = text.split_first_chunk::<STAMP>().ok_or(Refused::Length)?;
        Ok((Tick(u32::from_le_bytes(*stamp)), body))
    }
}

/// The number of the key that bytes say they are sealed with; to find the end they are for, where there are several. `None` when
/// they are no frame.
///
/// ```
/// assert_eq!(stampfly_link::secure::key_id(&[0; 14]), None);
/// ```
#[must_use]
pub fn key_id(frame: &[u8]) -> Option<u8> {
    match frame {
        [VERSION, _, id, ..] if (MIN_FRAME..=MAX_FRAME).contains(&frame.len()) => Some(*id),
        _ => None,
    }
}
