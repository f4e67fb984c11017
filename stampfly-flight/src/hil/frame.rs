//! Frames on a line that may lose and garble bytes.
//!
//! A frame is a body between two zeros. In the body no byte is zero, by consistent overhead byte stuffing (Cheshire and
//! Baker, 1997), so whoever has lost his place finds it again at the next zero, and what a board prints before it is one
//! garbled frame. Unstuffed, a body is
//!
//! | bytes | what |
//! |---|---|
//! | 2 | sequence |
//! | 1 | kind |
//! | any | payload |
//! | 2 | length of all before this |
//! | 4 | CRC-32 of all before this (ISO-HDLC: polynomial 0x04C11DB7, reflected) |
//!
//! Numbers are little-endian. Only for a line with one speaker at each end. There is no cryptography in it: who can reach the
//! line can fly the simulated vehicle.

use crate::crc::Crc;
use stampfly_types::Instant;

/// Bytes around a payload: sequence, kind, length, checksum.
const OVERHEAD: usize = 9;
/// What follows the payload.
const TRAILER: usize = 6;
/// Longest stretch without a zero that one code of the stuffing covers.
const STRETCH: u8 = 0xff;

/// Writes one frame into a buffer. What does not fit makes [`finish`](Self::finish) fail.
///
/// ```
/// use stampfly_flight::hil::{Decoder, Encoder};
/// let mut wire = [0; 32];
/// let mut frame = Encoder::new(&mut wire, 7, 3);
/// frame.put(&[1, 0, 2]);
/// let length = frame.finish().expect("it fits");
///
/// let mut decoder = Decoder::new([0; 16]);
/// let body = wire[..length].iter().find_map(|byte| decoder.feed(*byte).map(|body| (body.sequence, body.kind)));
/// assert_eq!(body, Some((7, 3)));
/// ```
#[derive(Debug)]
pub struct Encoder<'o> {
    out: &'o mut [u8],
    used: usize,
    /// Where the code of the present stretch will be written, and how long the stretch is with its code.
    code_at: usize,
    code: u8,
    length: u16,
    crc: Crc,
    is_cut: bool,
}

impl<'o> Encoder<'o> {
    /// Begins a frame.
    pub fn new(out: &'o mut [u8], sequence: u16, kind: u8) -> Self {
        let mut frame = Self { out, used: 0, code_at: 1, code: 1, length: 0, crc: Crc::START, is_cut: false };
        // The zero that ends whatever came before, and room for the first code.
        frame.raw(0);
        frame.raw(0);
        frame.put(&sequence.to_le_bytes());
        frame.put(&[kind]);
        frame
    }

    fn raw(&mut self, byte: u8) {
        match self.out.get_mut(self.used) {
            Some(place) => (*place, self.used) = (byte, self.used + 1),
            None => self.is_cut = true,
        }
    }

    /// Ends the stretch: its code is known.
    fn end_stretch(&mut self) {
        if let Some(place) = self.out.get_mut(self.code_at) {
            *place = self.code;
        }
        (self.code_at, self.code) = (self.used, 1);
    }

    fn stuff(&mut self, byte: u8) {
        if byte != 0 {
            self.raw(byte);
            self.code += 1;
        }
        if byte == 0 || self.code == STRETCH {
            self.end_stretch();
            self.raw(0);
        }
    }

    /// Adds bytes to the payload.
    pub fn put(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.crc.add(*byte);
            self.stuff(*byte);
        }
        self.length = self.length.saturating_add(bytes.len().try_into().unwrap_or(u16::MAX));
    }

    /// Adds an instant.
    pub fn instant(&mut self, at: Instant) {
        self.put(&at.as_micros().to_le_bytes());
    }

    /// Adds words.
    pub fn words(&mut self, words: &[u32]) {
        words.iter().for_each(|word| self.put(&word.to_le_bytes()));
    }

    /// Ends the frame and returns its length on the line; `None` when the buffer is too short for it.
    #[must_use]
    pub fn finish(mut self) -> Option<usize> {
        let length = self.length;
        self.put(&length.to_le_bytes());
        let crc = self.crc.finish();
        crc.to_le_bytes().into_iter().for_each(|byte| self.stuff(byte));
        self.end_stretch();
        self.raw(0);
        (!self.is_cut && length < u16::MAX).then_some(self.used)
    }
}

/// What a frame carried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Body<'f> {
    /// Which of the sender's frames it is. An answer has its question's.
    pub sequence: u16,
    /// What the payload is.
    pub kind: u8,
    /// The rest.
    pub payload: &'f [u8],
}

/// Finds frames in a stream of bytes.
///
/// `memory` holds one body, so it decides which frames are too long: a slice or a vector. See [`Encoder`] for an example.
#[derive(Debug)]
pub struct Decoder<M> {
    memory: M,
    used: usize,
    /// The present stretch's code, and bytes that it has still to come.
    code: u8,
    left: u8,
    /// A byte has come since the last zero; the body does not fit.
    begun: bool,
    is_cut: bool,
    garbled: u32,
}

impl<M: AsRef<[u8]> + AsMut<[u8]>> Decoder<M> {
    /// Nothing has come.
    pub const fn new(memory: M) -> Self {
        Self { memory, used: 0, code: STRETCH, left: 0, begun: false, is_cut: false, garbled: 0 }
    }

    /// Frames that were refused so far: cut short, garbled, too long, or text. Modulo 2³².
    #[must_use]
    pub const fn garbled(&self) -> u32 {
        self.garbled
    }

    fn keep(&mut self, byte: u8) {
        match self.memory.as_mut().get_mut(self.used) {
            Some(place) => (*place, self.used) = (byte, self.used + 1),
            None => self.is_cut = true,
        }
    }

    /// Takes a byte. Returns a body when it was the last of a frame whose length and checksum are right.
    pub fn feed(&mut self, byte: u8) -> Option<Body<'_>> {
        if byte != 0 {
            self.begun = true;
            if self.left > 0 {
                self.left -= 1;
                self.keep(byte);
            } else {
                // A code. The stretch before it ended with a zero, unless it was as long as one can be.
                if self.code != STRETCH {
                    self.keep(0);
                }
                (self.code, self.left) = (byte, byte - 1);
            }
            return None;
        }
        let (used, whole) = (self.used, self.left == 0 && !self.is_cut);
        let begun = core::mem::take(&mut self.begun);
        (self.used, self.code, self.left, self.is_cut) = (0, STRETCH, 0, false);
        if !begun {
            return None;
        }
        if !whole || !self.memory.as_ref().get(..used).is_some_and(is_sound) {
            self.garbled = self.garbled.wrapping_add(1);
            return None;
        }
        let (sequence, rest) = self.memory.as_ref().get(..used - TRAILER)?.split_first_chunk()?;
        let (kind, payload) = rest.split_first()?;
        Some(Body { sequence: u16::from_le_bytes(*sequence), kind: *kind, payload })
    }
}

/// Are the length and the checksum right?
fn is_sound(body: &[u8]) -> bool {
    let Some((rest, crc)) = body.split_last_chunk().filter(|_| body.len() >= OVERHEAD) else { return false };
    let mut expected = Crc::START;
    rest.iter().for_each(|byte| expected.add(*byte));
    let Some((content, length)) = rest.split_last_chunk() else { return false };
    u32::from_le_bytes(*crc) == expected.finish() && usize::from(u16::from_le_bytes(*length)) == content.len()
}

/// Takes numbers off a payload, one after the other. `None` when it is over.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fields<'f>(pub(super) &'f [u8]);

impl<'f> Fields<'f> {
    pub(super) fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*head)
    }

    pub(super) fn byte(&mut self) -> Option<u8> {
        self.array().map(|[byte]| byte)
    }

    pub(super) fn word(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub(super) fn long(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    pub(super) fn instant(&mut self) -> Option<Instant> {
        self.long().map(Instant::from_micros)
    }

    pub(super) fn rest(&mut self) -> &'f [u8] {
        core::mem::take(&mut self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn framed(sequence: u16, kind: u8, payload: &[u8]) -> Vec<u8> {
        let mut wire = std::vec![0; 2 * payload.len() + 32];
        let mut frame = Encoder::new(&mut wire, sequence, kind);
        frame.put(payload);
        let length = frame.finish().expect("there is room");
        wire.truncate(length);
        wire
    }

    fn read(bytes: &[u8], memory: usize) -> (Vec<(u16, u8, Vec<u8>)>, u32) {
        let mut decoder = Decoder::new(std::vec![0; memory]);
        let mut found = Vec::new();
        for byte in bytes {
            found.extend(decoder.feed(*byte).map(|body| (body.sequence, body.kind, body.payload.to_vec())));
        }
        (found, decoder.garbled())
    }

    #[test]
    fn the_checksum_is_the_one_it_says() {
        let mut crc = Crc::START;
        b"123456789".iter().for_each(|byte| crc.add(*byte));
        // The check value of CRC-32/ISO-HDLC.
        assert_eq!(crc.finish(), 0xCBF4_3926);
    }

    #[test]
    fn text_before_a_frame_costs_no_frame() {
        let mut bytes = b"boot: 0x1\r\n> hil\r\n".to_vec();
        bytes.extend(framed(1, 2, &[0, 0, 3]));
        assert_eq!(read(&bytes, 64), (std::vec![(1, 2, std::vec![0, 0, 3])], 1));
    }

    #[test]
    fn a_frame_longer_than_the_memory_is_refused_and_the_next_is_read() {
        let mut bytes = framed(1, 2, &[5; 100]);
        bytes.extend(framed(2, 2, &[5; 10]));
        assert_eq!(read(&bytes, 32), (std::vec![(2, 2, std::vec![5; 10])], 1));
    }

    #[test]
    fn a_buffer_that_is_too_short_is_noticed() {
        let whole = framed(1, 2, &[9; 40]).len();
        for room in 0..whole {
            let mut wire = std::vec![0; room];
            let mut frame = Encoder::new(&mut wire, 1, 2);
            frame.put(&[9; 40]);
            assert_eq!(frame.finish(), None, "{room}");
        }
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(sequence: u16, kind: u8, payload in prop::collection::vec(prop_oneof![Just(0), any::<u8>()], 0..600)) {
            let wire = framed(sequence, kind, &payload);
            prop_assert!(!wire[1..wire.len() - 1].contains(&0), "a zero within a frame");
            prop_assert_eq!(read(&wire, 700), (std::vec![(sequence, kind, payload)], 0));
        }

        #[test]
        fn a_garbled_byte_or_a_lost_one_costs_its_frame_only(payload in prop::collection::vec(any::<u8>(), 0..300), place: prop::sample::Index, flip in 1u8.., lose: bool) {
            let mut wire = framed(1, 2, &payload);
            let place = 1 + place.index(wire.len() - 2);
            if lose { _ = wire.remove(place) } else { wire[place] ^= flip }
            wire.extend(framed(2, 2, &payload));
            let (found, garbled) = read(&wire, 400);
            prop_assert_eq!(found, std::vec![(2, 2, payload)]);
            prop_assert!(garbled >= 1);
        }

        #[test]
        fn any_bytes_may_come(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
            read(&bytes, 100);
        }
    }
}
