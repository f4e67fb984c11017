//! Words from one core to another, or from one task to another: one writer, one reader, nobody waits.
//!
//! What is written becomes readable when it is committed, so a reader sees whole passes. A writer that finds no room is told so.
//! The words are atomics, so there is neither a data race nor `unsafe`, and the two ends may be in different interrupts or on
//! different cores.

use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use stampfly_bus::InPlace;

/// No place that is near the first one.
const NO_PART: u32 = 1 << 31;

/// Memory for so many words, a power of two.
///
/// ```
/// use stampfly_flight::compact::Ring;
/// let mut ring = Ring::<4>::new();
/// let (mut writer, mut reader) = ring.split();
/// assert!(writer.has_room(3));
/// [1, 2, 3].into_iter().for_each(|word| writer.word(word));
/// assert_eq!(reader.next(), None, "not committed yet");
/// writer.commit();
/// assert!(!writer.has_room(2));
/// assert_eq!((reader.next(), reader.next()), (Some(1), Some(2)));
/// assert!(writer.has_room(2));
/// ```
#[derive(Debug)]
pub struct Ring<const WORDS: usize> {
    memory: [AtomicU32; WORDS],
    /// Words that were committed so far. They wrap, as all places here do.
    written: AtomicU32,
    /// Where the newest part begins.
    part: AtomicU32,
    /// Words that were read so far.
    taken: AtomicU32,
    /// Somebody wants what is written.
    wanted: AtomicBool,
}

impl<const WORDS: usize> Ring<WORDS> {
    /// With nothing in it, and what is written is wanted.
    #[must_use]
    #[allow(clippy::new_without_default, reason = "`const`, for a static in firmware")]
    pub const fn new() -> Self {
        const { assert!(WORDS.is_power_of_two() && WORDS <= 1 << 30, "a ring has a power of two of words") };
        let [written, taken] = [const { AtomicU32::new(0) }; 2];
        let (part, wanted) = (AtomicU32::new(NO_PART), AtomicBool::new(true));
        Self { memory: [const { AtomicU32::new(0) }; WORDS], written, part, taken, wanted }
    }

    /// Its two ends.
    pub const fn split(&mut self) -> (RingWriter<'_, WORDS>, RingReader<'_, WORDS>) {
        let ring: &Self = self;
        (RingWriter { ring, place: 0, committed: 0, end: WORDS as u32, part: NO_PART }, RingReader { ring, place: 0 })
    }

    #[inline(always)]
    fn word(&self, place: u32) -> Option<&AtomicU32> {
        self.memory.get(place as usize & (WORDS - 1))
    }
}

/// The writing end.
#[derive(Debug)]
pub struct RingWriter<'r, const WORDS: usize> {
    ring: &'r Ring<WORDS>,
    /// Where the next word goes.
    place: u32,
    committed: u32,
    /// There was room up to here when it was last looked.
    end: u32,
    part: u32,
}

impl<const WORDS: usize> RingWriter<'_, WORDS> {
    /// Is there room for so many words?
    #[inline]
    pub fn has_room(&mut self, words: u32) -> bool {
        self.end.wrapping_sub(self.place) >= words || self.has_room_now(words)
    }

    /// The reader may have read since.
    #[inline(never)]
    fn has_room_now(&mut self, words: u32) -> bool {
        // Acquire: the reader has copied what it says it has taken.
        self.end = self.ring.taken.load(Ordering::Acquire).wrapping_add(WORDS as u32);
        self.end.wrapping_sub(self.place) >= words
    }

    /// Writes a word, for which there has to be room.
    #[inline(always)]
    pub fn word(&mut self, word: u32) {
        if let Some(place) = self.ring.word(self.place) {
            place.store(word, Ordering::Relaxed);
        }
        self.place = self.place.wrapping_add(1);
    }

    /// Writes words, for which there has to be room.
    #[inline(always)]
    pub fn words(&mut self, words: impl ExactSizeIterator<Item = u32>) {
        let (begin, count) = (self.place as usize & (WORDS - 1), words.len());
        match self.ring.memory.get(begin..begin + count) {
            Some(places) => {
                places.iter().zip(words).for_each(|(place, word)| place.store(word, Ordering::Relaxed));
                self.place = self.place.wrapping_add(count as u32);
            }
            // Around the end.
            None => words.for_each(|word| self.word(word)),
        }
    }

    /// Writes two words and those of a sample, for which there has to be room.
    #[inline(always)]
    pub fn sample(&mut self, head: [u32; 2], sample: &InPlace<'_>) {
        let (begin, count) = (self.place as usize & (WORDS - 1), sample.words().len() + 2);
        let places = self.ring.memory.get(begin..begin + count);
        match places.and_then(<[AtomicU32]>::split_first_chunk) {
            Some(([first, second], places)) => {
                let [one, two] = head;
                first.store(one, Ordering::Relaxed);
                second.store(two, Ordering::Relaxed);
                sample.copy_to(places);
                self.place = self.place.wrapping_add(count as u32);
            }
            // Around the end.
            None => head.into_iter().chain(sample.words()).for_each(|word| self.word(word)),
        }
    }

    /// Where the next word goes.
    #[cfg(feature = "key-frame")]
    pub(super) const fn place(&self) -> u32 {
        self.place
    }

    /// Changes a word that was written since the last commit.
    #[cfg(feature = "key-frame")]
    pub(super) fn change(&mut self, place: u32, word: u32) {
        if let Some(place) = self.ring.word(place) {
            place.store(word, Ordering::Relaxed);
        }
    }

    /// Does the reader want more? It says so with [`RingReader::want`].
    #[must_use]
    pub fn is_wanted(&self) -> bool {
        self.ring.wanted.load(Ordering::Relaxed)
    }

    /// A part begins at the next word.
    pub const fn begin_part(&mut self) {
        self.part = self.place;
    }

    /// The reader may read everything that was written.
    #[inline]
    pub fn commit(&mut self) {
        self.committed = self.place;
        // Release: the words are there.
        self.ring.written.store(self.place, Ordering::Release);
    }

    /// The same, and a part began [where it was said](Self::begin_part).
    pub fn commit_part(&mut self) {
        self.ring.part.store(self.part, Ordering::Relaxed);
        self.commit();
    }

    /// Takes back what was not committed.
    pub const fn discard(&mut self) {
        self.place = self.committed;
    }
}

/// The reading end.
#[derive(Debug)]
pub struct RingReader<'r, const WORDS: usize> {
    ring: &'r Ring<WORDS>,
    place: u32,
}

impl<const WORDS: usize> RingReader<'_, WORDS> {
    /// From now on more is wanted, or no more. Whoever writes looks now and then.
    pub fn want(&mut self, wanted: bool) {
        self.ring.wanted.store(wanted, Ordering::Relaxed);
    }

    /// Words that can be read, and before which of them the newest part begins, if it is one of them.
    #[must_use]
    pub fn available(&self) -> (u32, Option<u32>) {
        let words = self.ring.written.load(Ordering::Acquire).wrapping_sub(self.place);
        let part = self.ring.part.load(Ordering::Relaxed).wrapping_sub(self.place);
        (words, (part < words).then_some(part))
    }

    /// The next word. `None` when all were read.
    #[allow(clippy::should_implement_trait, reason = "a cursor, not an iterator: more may come after `None`")]
    pub fn next(&mut self) -> Option<u32> {
        if self.ring.written.load(Ordering::Acquire) == self.place {
            return None;
        }
        let word = self.ring.word(self.place)?.load(Ordering::Relaxed);
        self.place = self.place.wrapping_add(1);
        self.ring.taken.store(self.place, Ordering::Release);
        Some(word)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    proptest! {
        /// Whatever is committed comes out, in order, and nothing else, however often the ring goes round.
        #[test]
        fn what_is_committed_comes_out(steps in prop::collection::vec((0u32..9, 0usize..9, any::<bool>()), 1..200)) {
            let mut ring = Ring::<8>::new();
            let (mut writer, mut reader) = ring.split();
            let (mut count, mut expected, mut read) = (0, Vec::new(), Vec::new());
            for (words, reads, is_kept) in steps {
                if writer.has_room(words) {
                    let written: Vec<u32> = (0..words).map(|_| { count += 1; count }).collect();
                    written.iter().for_each(|word| writer.word(*word));
                    if is_kept {
                        writer.commit();
                        expected.extend(written);
                    } else {
                        writer.discard();
                    }
                } else {
                    prop_assert!(expected.len() - read.len() + words as usize > 8, "there is room");
                }
                read.extend((0..reads).map_while(|_| reader.next()));
            }
            read.extend(core::iter::from_fn(|| reader.next()));
            prop_assert_eq!(read, expected);
        }
    }

    #[test]
    fn a_part_is_read_by_itself() {
        let mut ring = Ring::<8>::new();
        let (mut writer, mut reader) = ring.split();
        writer.word(1);
        writer.word(2);
        writer.begin_part();
        writer.word(3);
        writer.commit_part();
        assert_eq!(reader.available(), (3, Some(2)));
        assert_eq!((reader.next(), reader.next()), (Some(1), Some(2)));
        assert_eq!(reader.available(), (1, Some(0)));
        assert_eq!(reader.next(), Some(3));
        assert_eq!(reader.available(), (0, None));
    }
}
