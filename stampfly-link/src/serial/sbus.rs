//! SBUS: sixteen sticks and two switches in 25 bytes, without a checksum.
//!
//! | byte | what |
//! |---|---|
//! | 0 | 0x0F |
//! | 1 to 22 | 16 channels of 11 bits, least significant bit first |
//! | 23 | bit 0 channel 17, bit 1 channel 18, bit 2 a frame was lost, bit 3 failsafe; the others are zero |
//! | 24 | 0x00; an SBUS2 receiver has 0x04, 0x14, 0x24 or 0x34 |
//!
//! The line is inverted: an idle one is low. On an ESP32 or an STM32F3 the UART turns it round; elsewhere a transistor does. Nobody has published
//! the format; this is what receivers send, as many flight controllers read it.

use super::Channels;
use crate::heard::Heard;
use stampfly_types::{Duration, Instant};

const START: u8 = 0x0F;
const CHANNEL_17: u8 = 1;
const CHANNEL_18: u8 = 1 << 1;
const FRAME_LOST: u8 = 1 << 2;
const FAILSAFE: u8 = 1 << 3;
const UNUSED: u8 = 0xF0;
/// A byte is 120 µs on the wire and follows the one before at once; the shortest pause between frames is 3 ms.
const PAUSE: Duration = Duration::from_micros(600);

/// What a receiver says.
///
/// ```
/// use stampfly_link::serial::{Channels, sbus::{SbusError, SbusFrame}};
/// let frame = SbusFrame { channel_17: true, ..SbusFrame::new(Channels([992; 16])) };
/// let mut bytes = frame.to_bytes();
/// assert_eq!(SbusFrame::decode(&bytes), Ok(frame));
/// bytes[24] = 0xFF;
/// assert_eq!(SbusFrame::decode(&bytes), Err(SbusError::End));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SbusFrame {
    /// The sticks.
    pub channels: Channels,
    /// A switch.
    pub channel_17: bool,
    /// A switch.
    pub channel_18: bool,
    /// The receiver has missed this frame of its transmitter's and repeats the one before. The sticks may be used.
    pub frame_lost: bool,
    /// The receiver has lost its transmitter. The sticks are made up and must not be used.
    pub failsafe: bool,
    /// The last byte, which tells SBUS2 receivers apart.
    pub end: u8,
}

/// Why 25 bytes are no frame, in the order it is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SbusError {
    /// It does not begin with 0x0F.
    Start,
    /// It does not end as one.
    End,
    /// Flags that no receiver sets.
    Flags,
}

impl core::fmt::Display for SbusError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Start => "does not begin as a frame",
            Self::End => "does not end as a frame",
            Self::Flags => "unknown flags",
        })
    }
}

impl core::error::Error for SbusError {}

impl SbusFrame {
    /// Length on the wire.
    pub const LENGTH: usize = 25;

    /// Sticks, and nothing to be said of them.
    #[must_use]
    pub const fn new(channels: Channels) -> Self {
        Self { channels, channel_17: false, channel_18: false, frame_lost: false, failsafe: false, end: 0 }
    }

    /// Reads a frame.
    ///
    /// # Errors
    /// When it is none.
    #[inline]
    pub fn decode(bytes: &[u8; Self::LENGTH]) -> Result<Self, SbusError> {
        let [start, packed @ .., flags, end] = bytes;
        if *start != START {
            return Err(SbusError::Start);
        }
        if !matches!(end, 0x00 | 0x04 | 0x14 | 0x24 | 0x34) {
            return Err(SbusError::End);
        }
        if flags & UNUSED != 0 {
            return Err(SbusError::Flags);
        }
        let is = |flag: u8| flags & flag != 0;
        Ok(Self {
            channels: Channels::unpack(packed),
            channel_17: is(CHANNEL_17),
            channel_18: is(CHANNEL_18),
            frame_lost: is(FRAME_LOST),
            failsafe: is(FAILSAFE),
            end: *end,
        })
    }

    /// As it travels.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; Self::LENGTH] {
        let when = |is: bool, flag: u8| if is { flag } else { 0 };
        let mut bytes = [START; Self::LENGTH];
        let [_, packed @ .., flags, end] = &mut bytes;
        *packed = self.channels.pack();
        *flags = when(self.channel_17, CHANNEL_17)
            | when(self.channel_18, CHANNEL_18)
            | when(self.frame_lost, FRAME_LOST)
            | when(self.failsafe, FAILSAFE);
        *end = self.end;
        bytes
    }
}

/// Finds frames in what a UART hands over.
///
/// A pause begins a frame. Bytes that come together, as from a buffer that is filled without the processor, have no pause between them:
/// then a frame begins where one ends as it should, and the next 0x0F is tried where it does not.
///
/// ```
/// use stampfly_link::serial::{Channels, sbus::{SbusDecoder, SbusFrame}};
/// use stampfly_types::Instant;
/// let mut decoder = SbusDecoder::new();
/// let frame = SbusFrame::new(Channels([992; 16]));
/// let bytes = [0xAA, 0x0F].into_iter().chain(frame.to_bytes()).chain(frame.to_bytes());
/// let found: Vec<_> = bytes.filter_map(|byte| decoder.feed(Instant::ZERO, byte)).collect();
/// assert_eq!(found, [frame, frame]);
/// assert_eq!(decoder.discarded(), 2);
/// ```
#[derive(Clone, Debug)]
pub struct SbusDecoder {
    heard: Heard<{ SbusFrame::LENGTH }>,
    newest: Instant,
}

impl Default for SbusDecoder {
    fn default() -> Self {
        Self::new()
    }
}

impl SbusDecoder {
    /// Has heard nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self { heard: Heard::new(), newest: Instant::ZERO }
    }

    /// Bytes so far that were part of no frame. Wraps around.
    #[must_use]
    pub const fn discarded(&self) -> u32 {
        self.heard.discarded()
    }

    /// Takes a byte that came at `at`. Returns the frame that it ends.
    #[inline]
    pub fn feed(&mut self, at: Instant, byte: u8) -> Option<SbusFrame> {
        self.pause(at);
        if self.heard.put_inside(byte) {
            return None;
        }
        if self.heard.is_empty() {
            // What does not begin as a frame is none.
            if byte == START {
                self.heard.push(byte);
            } else {
                self.heard.skip(1);
            }
            return None;
        }
        self.heard.push(byte);
        self.ended()
    }

    /// Takes bytes off the front of `bytes`, which came together and the last one at `at`, and returns the frame that they end. `None`
    /// when there are no more: ask until then. The same frames as of [`feed`](Self::feed) with one time for all of them, and less work for each byte.
    ///
    /// ```
    /// use stampfly_link::serial::{Channels, sbus::{SbusDecoder, SbusFrame}};
    /// use stampfly_types::Instant;
    /// let frame = SbusFrame::new(Channels([992; 16]));
    /// let buffer = [&[0xAA][..], &frame.to_bytes(), &frame.to_bytes(), &[0x0F]].concat();
    /// let (mut decoder, mut rest, mut found) = (SbusDecoder::new(), buffer.as_slice(), 0);
    /// while let Some(read) = decoder.read(Instant::ZERO, &mut rest) {
    ///     found += usize::from(read == frame);
    /// }
    /// assert_eq!((found, rest.len(), decoder.discarded()), (2, 0, 1));
    /// ```
    #[inline]
    pub fn read(&mut self, at: Instant, bytes: &mut &[u8]) -> Option<SbusFrame> {
        self.pause(at);
        while !bytes.is_empty() {
            if self.heard.is_empty() {
                let begins = bytes.iter().position(|byte| *byte == START).unwrap_or(bytes.len());
                self.heard.skip(begins);
                *bytes = bytes.get(begins..).unwrap_or_default();
            }
            self.heard.fill(SbusFrame::LENGTH, bytes);
            if self.heard.is_full()
                && let Some(frame) = self.ended()
            {
                return Some(frame);
            }
        }
        None
    }

    /// A pause ends what was not whole.
    #[inline]
    fn pause(&mut self, at: Instant) {
        // Bytes that came together have one time.
        if at != self.newest {
            self.goes_on(at);
        }
    }

    #[cold]
    #[inline(never)]
    fn goes_on(&mut self, at: Instant) {
        if at.since(self.newest) >= PAUSE {
            self.heard.discard_all();
        }
        self.newest = at;
    }

    /// The frame that all bytes are, or those from the next one on that may begin one.
    #[inline]
    fn ended(&mut self) -> Option<SbusFrame> {
        let whole = self.heard.whole()?;
        if let Ok(frame) = SbusFrame::decode(whole) {
            self.heard.take_all();
            return Some(frame);
        }
        self.heard.discard(begins_later(whole));
        None
    }
}

/// Where the next frame may begin, behind the first byte.
// Most often it is near: not worth the instructions that compare sixteen bytes at once, nor their place among others.
#[inline(never)]
fn begins_later(bytes: &[u8; SbusFrame::LENGTH]) -> usize {
    let mut place = 1;
    while bytes.get(place).is_some_and(|byte| *byte != START) {
        place += 1;
    }
    place
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    /// Bytes on the wire, one each 120 µs, after a pause of so many µs.
    fn heard(decoder: &mut SbusDecoder, at: &mut Instant, pause: u64, bytes: &[u8]) -> Vec<SbusFrame> {
        *at += Duration::from_micros(pause);
        let each = bytes.iter().filter_map(|byte| {
            *at += Duration::from_micros(120);
            decoder.feed(*at, *byte)
        });
        each.collect()
    }

    #[test]
    fn a_pause_ends_what_was_not_whole() {
        let frame = SbusFrame::new(Channels([0x0F; 16]));
        let (mut decoder, mut at) = (SbusDecoder::new(), Instant::ZERO);
        assert_eq!(heard(&mut decoder, &mut at, 3_000, &frame.to_bytes()[..17]), []);
        assert_eq!(heard(&mut decoder, &mut at, 3_000, &frame.to_bytes()), [frame]);
        assert_eq!(decoder.discarded(), 17);
    }

    #[test]
    fn flags_and_ends_that_nobody_sends_are_refused() {
        let bytes = SbusFrame::new(Channels([992; 16])).to_bytes();
        let changed = |place: usize, value| {
            let mut bytes = bytes;
            bytes[place] = value;
            SbusFrame::decode(&bytes)
        };
        assert_eq!(changed(0, 0xF0), Err(SbusError::Start));
        assert_eq!(changed(23, 0x10), Err(SbusError::Flags));
        for end in 0..=u8::MAX {
            let known = [0x00, 0x04, 0x14, 0x24, 0x34].contains(&end);
            assert_eq!(changed(24, end).is_ok(), known, "{end:#x}");
        }
    }

    proptest! {
        #[test]
        fn after_any_garbage_a_pause_is_enough(garbage in prop::collection::vec(any::<u8>(), 0..80), channels in prop::array::uniform16(0..2048_u16)) {
            let frame = SbusFrame::new(Channels(channels));
            let (mut decoder, mut at) = (SbusDecoder::new(), Instant::ZERO);
            heard(&mut decoder, &mut at, 0, &garbage);
            prop_assert_eq!(heard(&mut decoder, &mut at, 3_000, &frame.to_bytes()), [frame]);
        }

        /// However a stream is cut into buffers.
        #[test]
        fn a_buffer_has_the_frames_that_its_bytes_have(
            bytes in prop::collection::vec(prop_oneof![Just(START), Just(0), any::<u8>()], 0..300),
            places in prop::collection::vec(0..300_usize, 0..5),
            cut in 1..60_usize,
        ) {
            let mut bytes = bytes;
            for place in places {
                let place = place.min(bytes.len());
                bytes.splice(place..place, SbusFrame::new(Channels([place as u16; 16])).to_bytes());
            }
            let (mut whole, mut by_byte) = (SbusDecoder::new(), SbusDecoder::new());
            let mut found = Vec::new();
            for mut buffer in bytes.chunks(cut) {
                while let Some(frame) = whole.read(Instant::ZERO, &mut buffer) {
                    found.push(frame);
                }
                prop_assert!(buffer.is_empty());
            }
            let expected: Vec<_> = bytes.iter().filter_map(|byte| by_byte.feed(Instant::ZERO, *byte)).collect();
            prop_assert_eq!(found, expected);
            prop_assert_eq!((whole.discarded(), whole.heard.bytes()), (by_byte.discarded(), by_byte.heard.bytes()));
        }

        #[test]
        fn every_byte_is_in_a_frame_or_discarded_or_waits(bytes in prop::collection::vec(prop_oneof![Just(START), Just(0), any::<u8>()], 0..300)) {
            let (mut decoder, mut at) = (SbusDecoder::new(), Instant::ZERO);
            let frames = heard(&mut decoder, &mut at, 0, &bytes).len();
            let known = frames * SbusFrame::LENGTH + decoder.discarded() as usize + decoder.heard.len();
            prop_assert_eq!(known, bytes.len());
        }
    }
}
