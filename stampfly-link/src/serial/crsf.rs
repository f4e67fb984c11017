//! CRSF: frames of any kind with a CRC-8, sticks one way and telemetry the other. TBS Crossfire and ExpressLRS speak it.
//!
//! | byte | what |
//! |---|---|
//! | 0 | whom it is for; 0xC8 is a flight controller, 0xEE a transmitter, 0xEA its handset. From receivers come others, too |
//! | 1 | how many bytes follow, 2 to 62 |
//! | 2 | kind |
//! | … | payload, numbers big-endian |
//! | last | CRC-8 of kind and payload (polynomial 0xD5) |
//!
//! | kind | [`Message`] | from |
//! |---|---|---|
//! | 0x16 | [`Channels`], sixteen sticks | receiver |
//! | 0x14 | [`LinkStatistics`] | receiver |
//! | 0x08 | [`Battery`] | vehicle |
//! | 0x1E | [`Attitude`] | vehicle |
//! | 0x21 | [`FlightModeName`] | vehicle |
//! | 0x02 | [`Gps`] | vehicle |
//! | 0x07 | [`Vario`] | vehicle |
//!
//! Other kinds come as [`Message::Other`], their payload in the frame. A payload that is longer than its kind is known to be is a newer
//! version of it: the rest is not looked at. The format is TBS's (`crsf.md` of `tbs-fpv/tbs-crsf-spec`); where that document says 10 µV and
//! 10 µA for a battery, which do not fit, receivers mean 0.1 V and 0.1 A, and flight controllers send the speed over ground in 0.1 km/h.

use super::Channels;
use crate::crc8::crc8;
use crate::heard::Heard;

mod telemetry;

pub use telemetry::{Attitude, Battery, FlightModeName, Gps, LinkStatistics, Vario};

/// The longest frame.
const LONGEST: usize = 64;
/// Address, length, kind, CRC.
const OVERHEAD: usize = 4;
/// The length says how much follows it.
const AFTER_LENGTH: usize = 2;

/// A flight controller's address.
pub const FLIGHT_CONTROLLER: u8 = 0xC8;

const LINK_STATISTICS: u8 = 0x14;
const CHANNELS: u8 = 0x16;
const BATTERY: u8 = 0x08;
const ATTITUDE: u8 = 0x1E;
const FLIGHT_MODE: u8 = 0x21;
const GPS: u8 = 0x02;
const VARIO: u8 = 0x07;

/// A frame whose CRC is right.
///
/// ```
/// use stampfly_link::serial::{Channels, crsf::{CrsfFrame, Message}};
/// let mut bytes = [0; 64];
/// let length = Message::Channels(Channels([992; 16])).write(&mut bytes).expect("there is room");
/// let frame = CrsfFrame::decode(&bytes[..length])?;
/// assert_eq!(frame.message(), Message::Channels(Channels([992; 16])));
/// # Ok::<(), stampfly_link::serial::crsf::CrsfError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CrsfFrame<'f> {
    /// Whom it is for.
    pub address: u8,
    /// What its payload is.
    pub kind: u8,
    /// 0 to 60 bytes.
    pub payload: &'f [u8],
}

/// Why bytes are no frame, in the order it is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CrsfError {
    /// A length that no frame has.
    Length,
    /// More or fewer bytes than it says.
    Size,
    /// The CRC is wrong.
    Crc,
}

impl core::fmt::Display for CrsfError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Length => "a length that no frame has",
            Self::Size => "not as long as it says",
            Self::Crc => "wrong CRC",
        })
    }
}

impl core::error::Error for CrsfError {}

/// How long the frame is that begins so; `None` when none begins so, or that is not known yet.
fn size(bytes: &[u8]) -> Option<usize> {
    let length = usize::from(*bytes.get(1)?);
    (2..=LONGEST - AFTER_LENGTH).contains(&length).then_some(length + AFTER_LENGTH)
}

/// Is the CRC of a frame right, which is all of `bytes`?
fn is_sound(bytes: &[u8]) -> bool {
    matches!(bytes, [_, _, checked @ .., last] if crc8(checked) == *last)
}

impl<'f> CrsfFrame<'f> {
    /// The longest frame on the wire.
    pub const LONGEST: usize = LONGEST;

    /// Reads a frame, which has to be all of `bytes`.
    ///
    /// # Errors
    /// When it is none.
    pub fn decode(bytes: &'f [u8]) -> Result<Self, CrsfError> {
        let size = size(bytes).ok_or(CrsfError::Length)?;
        let (Some(frame), true) = (Self::of(bytes), bytes.len() == size) else { return Err(CrsfError::Size) };
        if is_sound(bytes) { Ok(frame) } else { Err(CrsfError::Crc) }
    }

    /// Takes it apart, sound or not.
    const fn of(bytes: &'f [u8]) -> Option<Self> {
        let [address, _, kind, payload @ .., _] = bytes else { return None };
        Some(Self { address: *address, kind: *kind, payload })
    }

    /// Writes it as it travels and returns how long it is; `None` when `out` is too short, or no frame can be so long.
    #[must_use]
    pub fn write(&self, out: &mut [u8]) -> Option<usize> {
        let size = self.payload.len() + OVERHEAD;
        let out = out.get_mut(..size).filter(|_| size <= LONGEST)?;
        let [address, length, kind, payload @ .., _] = &mut *out else { return None };
        (*address, *length, *kind) = (self.address, (size - AFTER_LENGTH) as u8, self.kind);
        payload.copy_from_slice(self.payload);
        let (last, checked) = out.split_last_mut()?;
        *last = crc8(checked.get(AFTER_LENGTH..)?);
        Some(size)
    }

    /// What it says. A kind that is not known here, or whose payload is too short, is [`Message::Other`].
    #[must_use]
    pub fn message(&self) -> Message {
        let known = match self.kind {
            CHANNELS => self.payload.first_chunk().map(|bytes| Message::Channels(Channels::unpack(bytes))),
            LINK_STATISTICS => {
                self.payload.first_chunk().map(|bytes| Message::LinkStatistics(LinkStatistics::read(bytes)))
            }
            BATTERY => self.payload.first_chunk().map(|bytes| Message::Battery(Battery::read(bytes))),
            ATTITUDE => self.payload.first_chunk().map(|bytes| Message::Attitude(Attitude::read(bytes))),
            FLIGHT_MODE => FlightModeName::read(self.payload).map(Message::FlightMode),
            GPS => self.payload.first_chunk().map(|bytes| Message::Gps(Gps::read(bytes))),
            VARIO => self.payload.first_chunk().map(|bytes| Message::Vario(Vario::read(bytes))),
            _ => None,
        };
        known.unwrap_or(Message::Other)
    }
}

/// What a frame says.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Message {
    /// The pilot's sticks.
    Channels(Channels),
    /// How well the radio is heard.
    LinkStatistics(LinkStatistics),
    /// The battery, for the pilot.
    Battery(Battery),
    /// The attitude, for the pilot.
    Attitude(Attitude),
    /// The flight mode's name, for the pilot.
    FlightMode(FlightModeName),
    /// Where the vehicle is, for the pilot.
    Gps(Gps),
    /// How fast it climbs, for the pilot.
    Vario(Vario),
    /// Something else: look at the frame.
    Other,
}

impl Message {
    /// Writes it as a frame for a [`FLIGHT_CONTROLLER`], which is also what receivers take telemetry from, and returns how long it is; `None` when `out` is
    /// too short, and for [`Other`](Self::Other).
    #[must_use]
    pub fn write(&self, out: &mut [u8]) -> Option<usize> {
        let mut write = |kind, payload: &[u8]| CrsfFrame { address: FLIGHT_CONTROLLER, kind, payload }.write(out);
        match self {
            Self::Channels(channels) => write(CHANNELS, &channels.pack()),
            Self::LinkStatistics(statistics) => write(LINK_STATISTICS, &statistics.to_bytes()),
            Self::Battery(battery) => write(BATTERY, &battery.to_bytes()),
            Self::Attitude(attitude) => write(ATTITUDE, &attitude.to_bytes()),
            Self::FlightMode(name) => write(FLIGHT_MODE, name.terminated()),
            Self::Gps(gps) => write(GPS, &gps.to_bytes()),
            Self::Vario(vario) => write(VARIO, &vario.to_bytes()),
            Self::Other => None,
        }
    }
}

/// Finds frames in what a UART hands over.
///
/// A frame has no mark that bytes in it cannot have, so it is known by its CRC alone: after garbage every byte is tried as a beginning.
///
/// ```
/// use stampfly_link::serial::{Channels, crsf::{CrsfDecoder, Message}};
/// let mut bytes = [0; 64];
/// let length = Message::Channels(Channels([992; 16])).write(&mut bytes).expect("there is room");
/// let mut decoder = CrsfDecoder::new();
/// let mut heard = [&[0xC8, 3, 1], &bytes[..length]].concat().into_iter();
/// let found = heard.find_map(|byte| decoder.feed(byte).map(|frame| frame.message()));
/// assert_eq!(found, Some(Message::Channels(Channels([992; 16]))));
/// assert_eq!(decoder.discarded(), 3);
/// ```
#[derive(Clone, Debug)]
pub struct CrsfDecoder {
    heard: Heard<LONGEST>,
    /// With fewer bytes there is nothing to be found.
    need: usize,
    /// Bytes of the frame that was returned last.
    taken: usize,
}

impl Default for CrsfDecoder {
    fn default() -> Self {
        Self::new()
    }
}

impl CrsfDecoder {
    /// Has heard nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self { heard: Heard::new(), need: AFTER_LENGTH, taken: 0 }
    }

    /// Bytes so far that were part of no frame. Wraps around.
    #[must_use]
    pub const fn discarded(&self) -> u32 {
        self.heard.discarded()
    }

    /// Takes a byte. Returns the frame that it ends.
    ///
    /// After garbage that looked like a beginning, a frame that came whole meanwhile is found with the next byte, wherever it lies.
    #[inline]
    pub fn feed(&mut self, byte: u8) -> Option<CrsfFrame<'_>> {
        self.forget();
        self.heard.push(byte);
        if self.heard.len() < self.need || !self.look() {
            return None;
        }
        self.frame()
    }

    /// Takes bytes off the front of `bytes`, as many as it needs, and returns the frame that they end. `None` when there are no more:
    /// ask until then. The same frames as of [`feed`](Self::feed), and less work for each byte.
    ///
    /// ```
    /// use stampfly_link::serial::{Channels, crsf::{CrsfDecoder, Message}};
    /// let mut bytes = [0; 64];
    /// let length = Message::Channels(Channels([992; 16])).write(&mut bytes).expect("there is room");
    /// let mut decoder = CrsfDecoder::new();
    /// let (mut found, buffer) = (0, [&bytes[..length], &bytes[..length], &[0xC8]].concat());
    /// let mut rest = buffer.as_slice();
    /// while let Some(frame) = decoder.read(&mut rest) {
    ///     found += usize::from(frame.message() == Message::Channels(Channels([992; 16])));
    /// }
    /// assert_eq!((found, rest.len()), (2, 0));
    /// ```
    #[inline]
    pub fn read(&mut self, bytes: &mut &[u8]) -> Option<CrsfFrame<'_>> {
        self.forget();
        // What was heard before may be a frame already.
        while self.heard.len() < self.need || !self.look() {
            if bytes.is_empty() {
                return None;
            }
            self.heard.fill(self.need.saturating_sub(self.heard.len()), bytes);
        }
        self.frame()
    }

    /// The frame that was returned last is not needed any more.
    fn forget(&mut self) {
        if self.taken > 0 {
            self.heard.take(core::mem::take(&mut self.taken));
            self.need = AFTER_LENGTH;
        }
    }

    fn frame(&self) -> Option<CrsfFrame<'_>> {
        self.heard.bytes().get(..self.taken).and_then(CrsfFrame::of)
    }

    /// Looks for a frame and gives up what is before it. Says whether it is whole; otherwise more bytes are needed.
    fn look(&mut self) -> bool {
        let bytes = self.heard.bytes();
        let (mut start, mut need) = (0, AFTER_LENGTH);
        while let Some(rest) = bytes.get(start..).filter(|rest| rest.len() >= AFTER_LENGTH) {
            match size(rest).map(|size| (size, rest.get(..size).map(is_sound))) {
                // It may still become one.
                Some((size, None)) => {
                    need = size;
                    break;
                }
                Some((size, Some(true))) => {
                    self.taken = size;
                    break;
                }
                None | Some((_, Some(false))) => start += 1,
            }
        }
        self.need = need;
        if start > 0 {
            self.heard.discard(start);
        }
        self.taken > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn heard(decoder: &mut CrsfDecoder, bytes: &[u8]) -> Vec<(u8, u8, Vec<u8>)> {
        let mut found = Vec::new();
        for byte in bytes {
            found.extend(decoder.feed(*byte).map(|frame| (frame.address, frame.kind, frame.payload.to_vec())));
        }
        found
    }

    fn framed(kind: u8, payload: &[u8]) -> Vec<u8> {
        let mut bytes = [0; LONGEST];
        let length = CrsfFrame { address: FLIGHT_CONTROLLER, kind, payload }.write(&mut bytes).expect("there is room");
        bytes[..length].to_vec()
    }

    #[test]
    fn a_longer_payload_is_a_newer_version() {
        let mut payload = Battery { voltage: 3.7, current: 0.5, used: 120, remaining: 55 }.to_bytes().to_vec();
        payload.push(9);
        let bytes = framed(BATTERY, &payload);
        let Message::Battery(battery) = CrsfFrame::decode(&bytes).expect("a frame").message() else {
            panic!("a battery")
        };
        assert_eq!((battery.used, battery.remaining), (120, 55));
        let bytes = framed(BATTERY, &payload[..7]);
        assert_eq!(CrsfFrame::decode(&bytes).expect("a frame").message(), Message::Other);
    }

    #[test]
    fn values_that_do_not_fit_are_the_most_and_no_numbers_are_zero() {
        let [v1, v0, a1, a0, ..] =
            Battery { voltage: f32::INFINITY, current: f32::NAN, used: u32::MAX, remaining: 0 }.to_bytes();
        assert_eq!(([v1, v0], [a1, a0]), ([0xFF; 2], [0; 2]));
        assert_eq!(Attitude { pitch: -9.0, roll: 9.0, yaw: f32::NAN }.to_bytes(), [0x80, 0, 0x7F, 0xFF, 0, 0]);
    }

    #[test]
    fn a_payload_that_is_too_long_is_not_written() {
        let frame = CrsfFrame { address: 0, kind: 0, payload: &[0; 61] };
        assert_eq!(frame.write(&mut [0; 100]), None);
        assert_eq!(CrsfFrame { payload: &[0; 60], ..frame }.write(&mut [0; 64]), Some(64));
        assert_eq!(CrsfFrame { payload: &[0; 60], ..frame }.write(&mut [0; 63]), None);
    }

    proptest! {
        #[test]
        fn garbage_that_is_no_length_costs_no_frame(garbage in prop::collection::vec(prop_oneof![0..2_u8, 63..=u8::MAX], 0..64), kind: u8, payload in prop::collection::vec(any::<u8>(), 0..=60)) {
            let mut decoder = CrsfDecoder::new();
            // Of garbage that has a length one in 256 is a frame: a CRC of eight bits is no more.
            let bytes = [&garbage[..], &framed(kind, &payload)].concat();
            let expected = std::vec![(FLIGHT_CONTROLLER, kind, payload)];
            prop_assert_eq!(heard(&mut decoder, &bytes), expected);
        }

        #[test]
        fn one_wrong_bit_costs_the_frame(kind: u8, payload in prop::collection::vec(any::<u8>(), 0..=60), place: prop::sample::Index, bit in 0..8) {
            let mut bytes = framed(kind, &payload);
            // The address is not part of the CRC.
            let place = 1 + place.index(bytes.len() - 1);
            bytes[place] ^= 1_u8 << bit;
            prop_assert!(CrsfFrame::decode(&bytes).is_err());
        }

        /// However a stream is cut into buffers.
        #[test]
        fn a_buffer_has_the_frames_that_its_bytes_have(
            bytes in prop::collection::vec(prop_oneof![Just(2), Just(4), any::<u8>()], 0..600),
            frames in prop::collection::vec((0..600_usize, any::<u8>(), 0..=60_usize), 0..6),
            cut in 1..100_usize,
        ) {
            let mut bytes = bytes;
            for (place, kind, length) in frames {
                let place = place.min(bytes.len());
                bytes.splice(place..place, framed(kind, &std::vec![kind; length]));
            }
            let (mut whole, mut by_byte) = (CrsfDecoder::new(), CrsfDecoder::new());
            let mut found = Vec::new();
            for mut buffer in bytes.chunks(cut) {
                while let Some(frame) = whole.read(&mut buffer) {
                    found.push((frame.address, frame.kind, frame.payload.to_vec()));
                }
                prop_assert!(buffer.is_empty());
            }
            let mut expected = heard(&mut by_byte, &bytes);
            // What is found with the byte after it is found without it.
            while let Some(frame) = by_byte.read(&mut &[][..]) {
                expected.push((frame.address, frame.kind, frame.payload.to_vec()));
            }
            prop_assert_eq!(found, expected);
            prop_assert_eq!(whole.discarded(), by_byte.discarded());
        }

        #[test]
        fn every_byte_is_in_a_frame_or_discarded_or_waits(bytes in prop::collection::vec(prop_oneof![Just(2), Just(4), any::<u8>()], 0..300)) {
            let mut decoder = CrsfDecoder::new();
            let frames: usize = heard(&mut decoder, &bytes).iter().map(|(_, _, payload)| payload.len() + OVERHEAD).sum();
            prop_assert_eq!(frames + decoder.discarded() as usize + decoder.heard.len() - decoder.taken, bytes.len());
        }
    }
}
