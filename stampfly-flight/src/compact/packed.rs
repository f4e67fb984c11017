//! Bytes on their way into a ring of words: a key frame is made where it waits, and needs no room of its own.

use super::ring::RingWriter;
use crate::key_frame::{KeyFrameError, Place};

/// Words before the length of a key frame: its magic.
const BEFORE_LENGTH: u32 = 1;

/// Puts bytes behind each other into words.
pub(super) struct Packed<'w, 'r, const WORDS: usize> {
    ring: &'w mut RingWriter<'r, WORDS>,
    begin: u32,
    /// The lowest bytes of the next word, and how many bits they have.
    partial: u32,
    bits: u32,
    length: usize,
}

impl<'w, 'r, const WORDS: usize> Packed<'w, 'r, WORDS> {
    /// The first byte begins a word.
    pub const fn new(ring: &'w mut RingWriter<'r, WORDS>) -> Self {
        let begin = ring.place();
        Self { ring, begin, partial: 0, bits: 0, length: 0 }
    }

    /// The rest of the last word is zeros. There has been room for it.
    pub fn finish(self) {
        if self.bits > 0 {
            self.ring.word(self.partial);
        }
    }
}

impl<const WORDS: usize> Place for Packed<'_, '_, WORDS> {
    #[inline]
    fn put(&mut self, bytes: &[u8]) -> Result<(), KeyFrameError> {
        let (words, rest) = bytes.as_chunks::<4>();
        // One more for what is begun.
        if !self.ring.has_room(words.len() as u32 + 2) {
            return Err(KeyFrameError::NoRoom);
        }
        for word in words {
            let word = u32::from_le_bytes(*word);
            self.ring.word(self.partial | word << self.bits);
            self.partial = word.checked_shr(32 - self.bits).unwrap_or_default();
        }
        for byte in rest {
            self.partial |= u32::from(*byte) << self.bits;
            self.bits += 8;
            if self.bits == 32 {
                self.ring.word(self.partial);
                (self.partial, self.bits) = (0, 0);
            }
        }
        self.length += bytes.len();
        Ok(())
    }

    fn length(&self) -> usize {
        self.length
    }

    fn set_length(&mut self, length: u32) {
        self.ring.change(self.begin.wrapping_add(BEFORE_LENGTH), length);
    }
}

#[cfg(test)]
mod tests {
    use super::super::ring::Ring;
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    proptest! {
        /// However they are handed over: the bytes stand behind each other, and where there is no room nothing is written over.
        #[test]
        fn bytes_come_out_as_they_went_in(pieces in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..11), 2..12)) {
            let mut ring = Ring::<16>::new();
            let (mut writer, mut reader) = ring.split();
            writer.word(7);
            let mut packed = Packed::new(&mut writer);
            let mut all: Vec<u8> = Vec::new();
            packed.put(&[1; 8]).expect("room");
            all.extend([1; 8]);
            for piece in &pieces {
                if packed.put(piece).is_err() {
                    break;
                }
                all.extend(piece);
            }
            packed.set_length(0x0403_0201);
            prop_assert_eq!(packed.length(), all.len());
            packed.finish();
            writer.commit();
            prop_assert_eq!(reader.next(), Some(7));
            let words = core::iter::from_fn(|| reader.next());
            let mut bytes: Vec<u8> = words.flat_map(u32::to_le_bytes).collect();
            prop_assert!(bytes.len() < all.len() + 4);
            bytes.truncate(all.len());
            all[4..8].copy_from_slice(&[1, 2, 3, 4]);
            prop_assert_eq!(bytes, all);
        }
    }
}
