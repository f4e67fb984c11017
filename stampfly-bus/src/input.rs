//! Inputs of a runnable: a reading end together with what it has read.
//!
//! | policy of the topic | input | what a runnable sees |
//! |---|---|---|
//! | `latest` | [`NewestInput`] | the newest sample, also when it is not new |
//! | `ring(N)`, `queue(N)` | [`SamplesInput`] | every sample since its last activation, oldest first |
//!
//! Inputs read themselves when their runnable is activated, and keep the samples where the runnable looks at them: a
//! sample is copied once, out of the ring or from the [output](NewestOutput) of another runnable, and not at all when it is the
//! one that is there already. What is published before the runnable runs waits for its next activation. Outside the runnables,
//! where nothing is activated, use a [`Subscriber`].

use crate::activation::Activation;
use crate::output::NewestOutput;
use crate::topic::{Latest, Sequential, Subscriber};
use core::ops::Deref;
use heapless::Vec;
use stampfly_types::{Duration, InputRecord, Instant, Message, Stamped};

/// The newest sample of a topic.
pub struct NewestInput<'b, T, const N: usize, const W: usize> {
    end: Subscriber<'b, T, Latest, N, W>,
    sample: Stamped<T>,
    is_new: bool,
}

impl<'b, T, const N: usize, const W: usize> NewestInput<'b, T, N, W>
where
    T: Message<Words = [u32; W]> + Default,
{
    #[doc(hidden)]
    #[inline(always)]
    pub fn __new(end: Subscriber<'b, T, Latest, N, W>) -> Self {
        Self { end, sample: Stamped { at: Instant::ZERO, generation: 0, data: T::default() }, is_new: false }
    }

    /// The newest message; the message's default before the first.
    #[inline]
    #[must_use]
    pub const fn get(&self) -> &T {
        &self.sample.data
    }

    /// The newest sample; `None` before the first.
    #[inline]
    #[must_use]
    pub fn sample(&self) -> Option<&Stamped<T>> {
        (self.sample.generation != 0).then_some(&self.sample)
    }

    /// Generation of the newest sample; zero before the first.
    #[inline]
    #[must_use]
    pub const fn generation(&self) -> u32 {
        self.sample.generation
    }

    /// How old the newest sample is at `now`; `None` before the first.
    #[inline]
    #[must_use]
    pub fn age(&self, now: Instant) -> Option<Duration> {
        self.sample().map(|sample| sample.age(now))
    }

    /// The newest message, if there is one and it is at most so old at `now`.
    #[inline]
    #[must_use]
    pub fn fresh(&self, now: Instant, limit: Duration) -> Option<&T> {
        self.sample().filter(|sample| sample.age(now) <= limit).map(|sample| &sample.data)
    }

    /// Is it another sample than at the activation before?
    #[inline]
    #[must_use]
    pub const fn is_new(&self) -> bool {
        self.is_new
    }

    /// Reads, as part of an activation.
    #[inline]
    pub fn read(&mut self, activation: &mut Activation) {
        let Some(input) = activation.recorded() else {
            activation.has_read(self.__read_newest());
            return;
        };
        self.is_new = input.generation != self.sample.generation;
        if self.is_new && !self.end.generation_into(input.generation, &mut self.sample) {
            activation.misses();
        }
    }

    /// In flight: reads from the bus.
    #[doc(hidden)]
    #[inline(always)]
    pub fn __read_newest(&mut self) -> InputRecord {
        self.is_new = self.end.head() != self.sample.generation && self.take_newest();
        self.record()
    }

    /// In flight: reads what another runnable has published.
    #[doc(hidden)]
    #[inline]
    pub fn __read_from(&mut self, output: &NewestOutput<'_, T, N, W>) -> InputRecord {
        let newest = output.newest();
        self.is_new = newest.generation != self.sample.generation;
        if self.is_new {
            self.sample = *newest;
        }
        self.record()
    }

    // Apart from asking whether there is one, as in a ring.
    #[inline(never)]
    fn take_newest(&mut self) -> bool {
        self.end.latest_into(&mut self.sample)
    }

    #[inline]
    fn record(&self) -> InputRecord {
        InputRecord { generation: self.sample.generation, taken: u16::from(self.is_new) }
    }
}

/// Every sample of a topic since the last activation, oldest first. A slice of [`Stamped`].
pub struct SamplesInput<'b, T, P, const N: usize, const W: usize> {
    end: Subscriber<'b, T, P, N, W>,
    samples: Vec<Stamped<T>, N>,
}

impl<'b, T, P, const N: usize, const W: usize> SamplesInput<'b, T, P, N, W>
where
    T: Message<Words = [u32; W]>,
    P: Sequential,
{
    #[doc(hidden)]
    #[inline(always)]
    pub fn __new(end: Subscriber<'b, T, P, N, W>) -> Self {
        Self { end, samples: Vec::new() }
    }

    /// Samples this runnable has missed because they were overwritten before it was activated.
    #[must_use]
    pub fn lost(&self) -> u32 {
        self.end.lost()
    }

    /// Reads, as part of an activation. More samples than the topic's depth stay for the next one.
    #[inline]
    pub fn read(&mut self, activation: &mut Activation) {
        let Some(input) = activation.recorded() else {
            activation.has_read(self.__read_newest());
            return;
        };
        self.samples.clear();
        let mut generation = crate::ring::before(input.generation, input.taken);
        for _ in 0..input.taken {
            generation = crate::ring::next(generation);
            match self.end.at_generation(generation) {
                Some(sample) if self.samples.push(sample).is_ok() => {}
                _ => activation.misses(),
            }
        }
    }

    /// In flight: reads from the bus.
    // Inlined without what is seldom done: most topics are slower than the runnables that read them.
    #[doc(hidden)]
    #[inline(always)]
    pub fn __read_newest(&mut self) -> InputRecord {
        self.samples.clear();
        if self.end.has_new() {
            self.take_new();
        }
        InputRecord { generation: self.end.generation(), taken: self.samples.len() as u16 }
    }

    #[inline(never)]
    fn take_new(&mut self) {
        while !self.samples.is_full() {
            let Some(sample) = self.end.next() else { break };
            // There is room.
            let _ = self.samples.push(sample);
        }
    }
}

impl<T, P, const N: usize, const W: usize> Deref for SamplesInput<'_, T, P, N, W> {
    type Target = [Stamped<T>];

    #[inline]
    fn deref(&self) -> &[Stamped<T>] {
        &self.samples
    }
}
