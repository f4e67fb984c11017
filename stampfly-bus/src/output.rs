//! Output of a runnable to other runnables: a writing end that keeps its newest sample where they can look at it.
//!
//! The runnables of a vehicle take turns: while one of them runs, no other publishes. So what one has published another reads
//! where the publisher keeps it, a plain struct: no sequence number to check, no message to make from words, nothing to copy. It is
//! on the bus all the same, for a log, for a replay, and for everybody outside.
//!
//! [`topics!`](crate::topics!) makes one for each `latest` topic from a runnable to runnables; all other topics have a
//! [`Publisher`].

use crate::topic::{Latest, Publisher, Topic};
use core::panic::UnwindSafe;
use stampfly_types::{Instant, Message, Stamped};

/// The writing end of a topic whose newest sample other runnables read.
#[must_use = "a topic nobody publishes is a wiring mistake"]
pub struct NewestOutput<'b, T, const N: usize, const W: usize> {
    publisher: Publisher<'b, T, Latest, N, W, 0>,
    newest: &'b mut Stamped<T>,
}

// The place is nobody else's while this end is there, and after a panic holds one sample or the other.
impl<T: UnwindSafe, const N: usize, const W: usize> UnwindSafe for NewestOutput<'_, T, N, W> {}

impl<'b, T, const N: usize, const W: usize> NewestOutput<'b, T, N, W> {
    #[doc(hidden)]
    #[inline(always)]
    pub fn __new(publisher: Publisher<'b, T, Latest, N, W, 0>, newest: &'b mut Stamped<T>) -> Self {
        Self { publisher, newest }
    }

    /// Where the newest sample is kept.
    #[doc(hidden)]
    #[inline(always)]
    #[must_use]
    pub fn __place(_: &Topic<T, Latest, N, W, 0>) -> Stamped<T>
    where
        T: Default,
    {
        Stamped { at: Instant::ZERO, generation: 0, data: T::default() }
    }
}

impl<T, const N: usize, const W: usize> NewestOutput<'_, T, N, W>
where
    T: Message<Words = [u32; W]> + Default,
{
    /// Publishes `data`, valid for the instant `at`. Returns its generation. Never waits, never fails.
    #[inline]
    pub fn publish(&mut self, at: Instant, data: &T) -> u32 {
        let words = data.to_words();
        let generation = self.publisher.write(at, &words);
        // What a reader would make of these words is this, or nothing.
        if T::from_words(&words).is_some() {
            *self.newest = Stamped { at, generation, data: *data };
        }
        generation
    }

    /// Generation of the newest sample, zero before the first.
    #[must_use]
    pub const fn generation(&self) -> u32 {
        self.publisher.generation()
    }

    /// As [`Publisher::publish_words`].
    pub fn publish_words(&mut self, at: Instant, words: &[u32]) -> Option<u32> {
        let words: &[u32; W] = words.try_into().ok()?;
        let generation = self.publisher.publish_words(at, words)?;
        self.keep(at, generation, words);
        Some(generation)
    }

    /// As [`Publisher::restore_words`].
    pub fn restore_words(&mut self, at: Instant, generation: u32, words: &[u32]) -> Option<()> {
        let words: &[u32; W] = words.try_into().ok()?;
        self.publisher.restore_words(at, generation, words)?;
        self.keep(at, generation, words);
        Some(())
    }

    /// Keeps what a reader of the topic would make of these words: nothing, if they are no message. An attitude of another length
    /// than one is none, and the readers go on with the sample before.
    #[inline]
    fn keep(&mut self, at: Instant, generation: u32, words: &[u32; W]) {
        if let Some(data) = T::from_words(words) {
            *self.newest = Stamped { at, generation, data };
        }
    }
}
