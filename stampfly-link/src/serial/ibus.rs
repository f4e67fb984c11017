//! iBUS: fourteen sticks in microseconds, in 32 bytes with a sum. FlySky's receivers speak it.
//!
//! | byte | what |
//! |---|---|
//! | 0 | 0x20, the length |
//! | 1 | 0x40, "these are servos"; some receivers have 0x00 |
//! | 2 to 29 | 14 channels of 16 bits, little-endian: 12 bits of pulse, and in the top four bits of the first twelve three parts each of channels 15 to 18 |
//! | 30, 31 | 0xFFFF less the sum of all bytes before |
//!
//! Not for the older IA6, whose frames begin with 0x55. The format is not published; frames of two receivers from public tests are among the
//! vectors it is tested with.

use crate::heard::Heard;

const LENGTH: usize = 32;
const SERVOS: u8 = 0x40;
const LOW: u16 = 0x0FFF;

/// What a receiver says.
///
/// ```
/// use stampfly_link::serial::ibus::{IbusError, IbusFrame};
/// let frame = IbusFrame { channels: [1500; 14], ..IbusFrame::default() };
/// let mut bytes = frame.to_bytes();
/// assert_eq!(IbusFrame::decode(&bytes), Ok(frame));
/// bytes[5] ^= 1;
/// assert_eq!(IbusFrame::decode(&bytes), Err(IbusError::Sum));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IbusFrame {
    /// The second byte: 0x40, or 0x00.
    pub command: u8,
    /// Pulses, µs: 1000 to 2000, 1500 when let go; 4095 is the most that fits.
    pub channels: [u16; 14],
    /// Channels 15 to 18, µs. Zero where the receiver has none.
    pub more: [u16; 4],
}

impl Default for IbusFrame {
    /// Every channel at 0 µs, which no stick is.
    fn default() -> Self {
        Self { command: SERVOS, channels: [0; 14], more: [0; 4] }
    }
}

/// Why 32 bytes are no frame, in the order it is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum IbusError {
    /// It does not begin as one.
    Start,
    /// The sum is wrong.
    Sum,
}

impl core::fmt::Display for IbusError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Start => "does not begin as a frame",
            Self::Sum => "wrong sum",
        })
    }
}

impl core::error::Error for IbusError {}

/// 0xFFFF less the sum of these bytes.
fn sum(bytes: &[u8]) -> u16 {
    bytes.iter().fold(u16::MAX, |sum, byte| sum.wrapping_sub(u16::from(*byte)))
}

fn begins(bytes: &[u8]) -> bool {
    match bytes {
        [] => true,
        [length] => usize::from(*length) == LENGTH,
        [length, command, ..] => usize::from(*length) == LENGTH && matches!(*command, SERVOS | 0),
    }
}

impl IbusFrame {
    /// Length on the wire.
    pub const LENGTH: usize = LENGTH;

    /// Reads a frame.
    ///
    /// # Errors
    /// When it is none.
    pub fn decode(bytes: &[u8; LENGTH]) -> Result<Self, IbusError> {
        let [_, command, words @ .., low, high] = bytes;
        if !begins(bytes) {
            return Err(IbusError::Start);
        }
        let summed = bytes.split_last_chunk::<2>().map_or(0, |(summed, _)| sum(summed));
        if summed != u16::from_le_bytes([*low, *high]) {
            return Err(IbusError::Sum);
        }
        let (pairs, _) = words.as_chunks::<2>();
        let mut frame = Self { command: *command, ..Self::default() };
        for (channel, pair) in frame.channels.iter_mut().zip(pairs) {
            *channel = u16::from_le_bytes(*pair) & LOW;
        }
        // Three parts of four bits, the lowest first.
        for (channel, parts) in frame.more.iter_mut().zip(pairs.chunks_exact(3)) {
            *channel = parts.iter().rev().fold(0, |channel, [_, high]| channel << 4 | u16::from(*high >> 4));
        }
        Ok(frame)
    }

    /// As it travels. Of a pulse beyond 4095 µs the low twelve bits.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; LENGTH] {
        let mut bytes = [LENGTH as u8; LENGTH];
        let parts = self.more.iter().flat_map(|channel| [0, 4, 8].map(|shift| channel >> shift & 0xF));
        let words = self.channels.iter().zip(parts.chain([0; 2])).map(|(channel, part)| channel & LOW | part << 12);
        if let Some((head, rest)) = bytes.split_first_chunk_mut::<2>() {
            head[1] = self.command;
            for (pair, word) in rest.as_chunks_mut::<2>().0.iter_mut().zip(words) {
                *pair = word.to_le_bytes();
            }
        }
        if let Some((summed, at)) = bytes.split_last_chunk_mut::<2>() {
            *at = sum(summed).to_le_bytes();
        }
        bytes
    }
}

/// Finds frames in what a UART hands over.
///
/// ```
/// use stampfly_link::serial::ibus::{IbusDecoder, IbusFrame};
/// let mut decoder = IbusDecoder::new();
/// let frame = IbusFrame { channels: [1500; 14], ..IbusFrame::default() };
/// let bytes = [0x20, 0x40, 7].into_iter().chain(frame.to_bytes()).chain(frame.to_bytes());
/// let found: Vec<_> = bytes.filter_map(|byte| decoder.feed(byte)).collect();
/// assert_eq!(found, [frame, frame]);
/// assert_eq!(decoder.discarded(), 3);
/// ```
#[derive(Clone, Debug)]
pub struct IbusDecoder {
    heard: Heard<LENGTH>,
}

impl Default for IbusDecoder {
    fn default() -> Self {
        Self::new()
    }
}

impl IbusDecoder {
    /// Has heard nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self { heard: Heard::new() }
    }

    /// Bytes so far that were part of no frame. Wraps around.
    #[must_use]
    pub const fn discarded(&self) -> u32 {
        self.heard.discarded()
    }

    /// Takes a byte. Returns the frame that it ends.
    pub fn feed(&mut self, byte: u8) -> Option<IbusFrame> {
        self.heard.push(byte);
        if let Some(whole) = self.heard.whole() {
            if let Ok(frame) = IbusFrame::decode(whole) {
                self.heard.take(LENGTH);
                return Some(frame);
            }
            self.heard.discard(1);
        }
        let bytes = self.heard.bytes();
        let first = (0..bytes.len()).find(|first| bytes.get(*first..).is_some_and(begins));
        self.heard.discard(first.unwrap_or(self.heard.len()));
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn heard(decoder: &mut IbusDecoder, bytes: &[u8]) -> Vec<IbusFrame> {
        bytes.iter().filter_map(|byte| decoder.feed(*byte)).collect()
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(channels in prop::array::uniform14(0..=LOW), more in prop::array::uniform4(0..=LOW)) {
            let frame = IbusFrame { channels, more, ..IbusFrame::default() };
            prop_assert_eq!(IbusFrame::decode(&frame.to_bytes()), Ok(frame));
        }

        #[test]
        fn after_any_garbage_the_second_frame_is_found(garbage in prop::collection::vec(prop_oneof![Just(0x20), Just(0x40), any::<u8>()], 0..80), channels in prop::array::uniform14(0..=LOW)) {
            let frame = IbusFrame { channels, ..IbusFrame::default() };
            let mut decoder = IbusDecoder::new();
            let bytes = [&garbage[..], &frame.to_bytes(), &frame.to_bytes()].concat();
            prop_assert!(heard(&mut decoder, &bytes).contains(&frame));
        }

        #[test]
        fn every_byte_is_in_a_frame_or_discarded_or_waits(bytes in prop::collection::vec(prop_oneof![Just(0x20), Just(0x40), any::<u8>()], 0..300)) {
            let mut decoder = IbusDecoder::new();
            let frames = heard(&mut decoder, &bytes).len();
            prop_assert_eq!(frames * LENGTH + decoder.discarded() as usize + decoder.heard.len(), bytes.len());
        }
    }
}
