//! The one primitive: a single-writer broadcast ring of words.
//!
//! `N` slots, each with a sequence number and `W` payload words, all of them atomics: there is no data race by
//! construction and no `unsafe`. The writer never waits and never fails. A reader copies a slot and checks that
//! its sequence number did not move meanwhile (a seqlock; Boehm, "Can Seqlocks Get Along With Programming
//! Language Memory Models?", MSPC 2012). Callable from interrupts, correct across cores, no critical section, no
//! 64-bit atomics.
//!
//! Generations count published samples from one; zero means "none yet". They wrap after 2³² samples (124 days at
//! 400 Hz), which every comparison here allows for.
//!
//! Use the typed [`Topic`](crate::Topic) on top; this layer is what loom checks.

use crate::sync::{AtomicU32, Ordering, fence, unless_loom_const};
use stampfly_types::Instant;

/// One sample's place in the ring.
struct Slot<const W: usize> {
    /// `2 · generation` when complete, `2 · generation − 1` while being written.
    sequence: AtomicU32,
    at: [AtomicU32; 2],
    words: [AtomicU32; W],
}

impl<const W: usize> Slot<W> {
    unless_loom_const! {
        fn new() -> Self {
            Self {
                sequence: AtomicU32::new(0),
                at: [const { AtomicU32::new(0) }; 2],
                words: [const { AtomicU32::new(0) }; W],
            },
            Self {
                sequence: AtomicU32::new(0),
                at: core::array::from_fn(|_| AtomicU32::new(0)),
                words: core::array::from_fn(|_| AtomicU32::new(0)),
            }
        }
    }
}

impl<const W: usize> Slot<W> {
    #[inline]
    fn stamp(&self) -> Instant {
        let [low, high] = self.at.each_ref().map(|half| u64::from(half.load(Ordering::Relaxed)));
        Instant::from_micros(low | high << 32)
    }
}

/// A single-writer broadcast ring: `N` slots (a power of two) of `W` words.
pub(crate) struct Ring<const N: usize, const W: usize> {
    /// Newest complete generation.
    head: AtomicU32,
    slots: [Slot<W>; N],
}

/// A sample where it lies on the bus, which may be overwritten while it is read: ask [`is_whole`](Self::is_whole) afterwards.
#[derive(Clone, Copy)]
pub struct InPlace<'b> {
    sequence: &'b AtomicU32,
    complete: u32,
    at: &'b [AtomicU32; 2],
    words: &'b [AtomicU32],
}

impl InPlace<'_> {
    /// The instant it is valid for, in two words, the lower one first.
    #[inline(always)]
    #[must_use]
    pub fn at(&self) -> [u32; 2] {
        self.at.each_ref().map(|half| half.load(Ordering::Relaxed))
    }

    /// The lower one of these words.
    #[inline(always)]
    #[must_use]
    pub fn at_low(&self) -> u32 {
        let [low, _] = self.at;
        low.load(Ordering::Relaxed)
    }

    /// Its words.
    #[inline(always)]
    pub fn words(&self) -> impl ExactSizeIterator<Item = u32> {
        self.words.iter().map(|word| word.load(Ordering::Relaxed))
    }

    /// Copies its words to as many places: four at a time, which halves the instructions.
    #[inline(always)]
    pub fn copy_to(&self, places: &[core::sync::atomic::AtomicU32]) {
        let store = |place: &core::sync::atomic::AtomicU32, word: &AtomicU32| {
            place.store(word.load(Ordering::Relaxed), core::sync::atomic::Ordering::Relaxed);
        };
        let ((words, last_words), (places, last_places)) = (self.words.as_chunks::<4>(), places.as_chunks::<4>());
        for (places, words) in places.iter().zip(words) {
            places.iter().zip(words).for_each(|(place, word)| store(place, word));
        }
        last_places.iter().zip(last_words).for_each(|(place, word)| store(place, word));
    }

    /// Was everything that has been read of it still there?
    #[inline(always)]
    #[must_use]
    pub fn is_whole(&self) -> bool {
        fence(Ordering::Acquire);
        self.sequence.load(Ordering::Relaxed) == self.complete
    }
}

/// A copy of a slot.
pub(crate) struct Copied<const W: usize> {
    pub(crate) at: Instant,
    pub(crate) words: [u32; W],
}

impl<const N: usize, const W: usize> Ring<N, W> {
    const MASK: u32 = {
        assert!(
            N.is_power_of_two() && N >= 2 && N <= 1 << 16,
            "the depth of a topic is a power of two from 2 to 65536"
        );
        N as u32 - 1
    };

    unless_loom_const! {
        pub(crate) fn new() -> Self {
            Self { head: AtomicU32::new(0), slots: [const { Slot::new() }; N] },
            Self { head: AtomicU32::new(0), slots: core::array::from_fn(|_| Slot::new()) }
        }
    }

    /// Newest complete generation, zero before the first.
    #[inline]
    pub(crate) fn head(&self) -> u32 {
        self.head.load(Ordering::Acquire)
    }

    /// Can a reader have read as far as this generation? One that is ahead of the newest would look for it for ever.
    pub(crate) fn has_published(&self, generation: u32) -> bool {
        let head = self.head();
        generation == head || head != 0 && head.wrapping_sub(generation) < 1 << 31
    }

    /// Where the newest complete generation is counted.
    pub(crate) const fn counter(&self) -> &AtomicU32 {
        &self.head
    }

    #[inline]
    fn slot(&self, generation: u32) -> Option<&Slot<W>> {
        self.slots.get((generation & Self::MASK) as usize)
    }

    /// Writes the next sample. Must only ever be called by the one publisher, which hands in the generation it
    /// wrote last.
    #[inline]
    pub(crate) fn write(&self, previous: u32, at: Instant, words: &[u32; W]) -> u32 {
        let generation = next(previous);
        let Some(slot) = self.slot(generation) else { return previous };
        let complete = generation.wrapping_mul(2);
        slot.sequence.store(complete.wrapping_sub(1), Ordering::Relaxed);
        // Readers that see any of the words below also see the odd sequence above.
        fence(Ordering::Release);
        let micros = at.as_micros();
        slot.at[0].store(micros as u32, Ordering::Relaxed);
        slot.at[1].store((micros >> 32) as u32, Ordering::Relaxed);
        for (place, word) in slot.words.iter().zip(words) {
            place.store(*word, Ordering::Relaxed);
        }
        slot.sequence.store(complete, Ordering::Release);
        self.head.store(generation, Ordering::Release);
        generation
    }

    /// The stamp of the sample of this generation; `None` when it is not there (any more, or yet).
    #[inline]
    pub(crate) fn stamp(&self, generation: u32) -> Option<Instant> {
        let slot = self.slot(generation)?;
        let complete = generation.wrapping_mul(2);
        if slot.sequence.load(Ordering::Acquire) != complete {
            return None;
        }
        let at = slot.stamp();
        fence(Ordering::Acquire);
        (slot.sequence.load(Ordering::Relaxed) == complete).then_some(at)
    }

    /// The sample of this generation where it lies; `None` when it is not there (any more, or yet).
    #[inline]
    pub(crate) fn in_place(&self, generation: u32) -> Option<InPlace<'_>> {
        let slot = self.slot(generation)?;
        let complete = generation.wrapping_mul(2);
        (generation != 0 && slot.sequence.load(Ordering::Acquire) == complete).then_some(InPlace {
            sequence: &slot.sequence,
            complete,
            at: &slot.at,
            words: &slot.words,
        })
    }

    /// Copies the sample of this generation; `None` when it is not there (any more, or yet).
    #[inline]
    pub(crate) fn read(&self, generation: u32) -> Option<Copied<W>> {
        let slot = self.slot(generation)?;
        let complete = generation.wrapping_mul(2);
        if slot.sequence.load(Ordering::Acquire) != complete {
            return None;
        }
        let at = slot.stamp();
        let mut words = [0; W];
        for (word, place) in words.iter_mut().zip(&slot.words) {
            *word = place.load(Ordering::Relaxed);
        }
        // The words above were read before the sequence below.
        fence(Ordering::Acquire);
        (slot.sequence.load(Ordering::Relaxed) == complete).then_some(Copied { at, words })
    }
}

/// The generation after this one. Zero is skipped on wrap: it means "none yet".
#[inline]
pub(crate) const fn next(generation: u32) -> u32 {
    match generation.wrapping_add(1) {
        0 => 1,
        following => following,
    }
}

/// The generation so many samples before this one. Zero is skipped when it wraps.
#[inline]
pub(crate) const fn before(generation: u32, samples: u16) -> u32 {
    let earlier = generation.wrapping_sub(samples as u32);
    if earlier > generation { earlier.wrapping_sub(1) } else { earlier }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn so_many_samples_after_before_come_back(start in prop_oneof![1u32..100, u32::MAX - 50..=u32::MAX], samples in 0u16..100) {
            let end = (0..samples).fold(start, |generation, _| next(generation));
            let first = before(end, samples);
            // Zero and the last generation before the wrap have the same successor.
            prop_assert!(first == start || first == 0 && start == u32::MAX);
            prop_assert_eq!((0..samples).fold(first, |generation, _| next(generation)), end);
        }
    }
}
