//! Inputs of a runnable: a reading end together with what it has read.
//!
//! | policy of the topic | input | what a runnable sees |
//! |---|---|---|
//! | `latest` | [`NewestInput`] | the newest sample, also when it is not new |
//! | `ring(N)`, `queue(N)` | [`SamplesInput`] | every sample since its last activation, oldest first |
//!
//! Inputs read themselves when their runnable is activated. What comes from outside is copied once, out of the ring, and not at all
//! when it is the sample that is there already. The newest sample of another runnable is not copied: it is looked at where
//! its [output](crate::NewestOutput) keeps it, unless something may be published before the runnable runs. Such a sample waits
//! for the next activation. Outside the runnables, where nothing is activated, use a [`Subscriber`].
//!
//! An input is made for an activation; what it has to know at the next one is in a port.

use crate::activation::Activation;
use crate::ring::Ring;
use crate::sync::AtomicU32;
use crate::topic::{Latest, Sequential, Subscriber, Topic};
use core::ops::Deref;
use core::panic::UnwindSafe;
use heapless::Vec;
use stampfly_types::{Duration, InputRecord, Instant, Message, Stamped};

/// What a [`NewestInput`] knows from one activation to the next.
#[doc(hidden)]
#[derive(Debug)]
pub struct NewestPort<T> {
    /// The newest sample read. Of one that is lent, the generation alone.
    sample: Stamped<T>,
    is_new: bool,
    is_lent: bool,
}

impl<T: Default> NewestPort<T> {
    #[inline(always)]
    pub fn __new() -> Self {
        Self { sample: Stamped { at: Instant::ZERO, generation: 0, data: T::default() }, is_new: false, is_lent: false }
    }
}

/// The newest sample of a topic.
pub struct NewestInput<'b, T, const N: usize, const W: usize> {
    ring: &'b Ring<N, W>,
    port: &'b mut NewestPort<T>,
    /// The newest sample of another runnable, where that one keeps it.
    lender: Option<&'b Stamped<T>>,
}

// The port is nobody else's, and after a panic as good as any: numbers, and a sample that was written as a whole.
impl<T: UnwindSafe, const N: usize, const W: usize> UnwindSafe for NewestInput<'_, T, N, W> {}

impl<'b, T, const N: usize, const W: usize> NewestInput<'b, T, N, W> {
    #[doc(hidden)]
    #[inline(always)]
    pub fn __new(
        topic: &'b Topic<T, Latest, N, W, 0>,
        port: &'b mut NewestPort<T>,
        lender: Option<&'b Stamped<T>>,
    ) -> Self {
        Self { ring: topic.ring(), port, lender }
    }
}

impl<T, const N: usize, const W: usize> NewestInput<'_, T, N, W>
where
    T: Message<Words = [u32; W]> + Default,
{
    #[inline(always)]
    const fn newest(&self) -> &Stamped<T> {
        match self.lender {
            Some(newest) if self.port.is_lent => newest,
            _ => &self.port.sample,
        }
    }

    /// The newest message; the message's default before the first.
    #[inline]
    #[must_use]
    pub const fn get(&self) -> &T {
        &self.newest().data
    }

    /// The newest sample; `None` before the first.
    #[inline]
    #[must_use]
    pub fn sample(&self) -> Option<&Stamped<T>> {
        (self.generation() != 0).then_some(self.newest())
    }

    /// Generation of the newest sample; zero before the first.
    #[inline]
    #[must_use]
    pub const fn generation(&self) -> u32 {
        self.port.sample.generation
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
        self.port.is_new
    }

    /// Reads, as part of an activation, what stays as it is until the next one.
    #[inline]
    pub fn read(&mut self, activation: &mut Activation) {
        if let Some(generation) = activation.position(self.port.record()) {
            self.port.seek(self.ring, generation);
            return;
        }
        let Some(input) = activation.recorded() else {
            match self.lender {
                Some(newest) => self.port.copy(newest),
                None => self.port.read_bus(self.ring),
            }
            activation.has_read(self.port.record());
            return;
        };
        let is_held = !core::mem::take(&mut self.port.is_lent) || input.generation == 0;
        // Recorded, because a replay that begins at a key frame has read nothing yet.
        self.port.is_new = input.taken != 0;
        if (input.generation != self.port.sample.generation || !is_held)
            && !end::<T, N, W>(self.ring).generation_into(input.generation, &mut self.port.sample)
        {
            activation.misses();
        }
    }

    /// In flight: looks at what another runnable has published, which that one may publish again; copies what comes from outside.
    #[doc(hidden)]
    #[inline(always)]
    pub fn __look(&mut self) -> InputRecord {
        match self.lender {
            Some(newest) => self.port.borrow(newest),
            None => self.port.read_bus(self.ring),
        }
        self.port.record()
    }
}

#[inline(always)]
fn end<T, const N: usize, const W: usize>(ring: &Ring<N, W>) -> Subscriber<'_, T, Latest, N, W> {
    Subscriber::at(ring, None, (0, 0))
}

impl<T> NewestPort<T> {
    #[inline(always)]
    fn read_bus<const N: usize, const W: usize>(&mut self, ring: &Ring<N, W>)
    where
        T: Message<Words = [u32; W]>,
    {
        self.is_new = ring.head() != self.sample.generation && self.take_newest(ring);
    }

    // Apart from asking whether there is one, as in a ring.
    #[inline(never)]
    fn take_newest<const N: usize, const W: usize>(&mut self, ring: &Ring<N, W>) -> bool
    where
        T: Message<Words = [u32; W]>,
    {
        end::<T, N, W>(ring).latest_into(&mut self.sample)
    }

    /// The newest sample read is this one.
    #[inline(never)]
    fn seek<const N: usize, const W: usize>(&mut self, ring: &Ring<N, W>, generation: u32)
    where
        T: Message<Words = [u32; W]>,
    {
        if generation != self.sample.generation {
            // What is not on the bus any more is not the newest, so nobody will look at it.
            let _ = end::<T, N, W>(ring).generation_into(generation, &mut self.sample);
            self.sample.generation = generation;
            self.is_lent = false;
        }
    }

    #[inline(always)]
    fn borrow(&mut self, newest: &Stamped<T>) {
        self.is_new = newest.generation != self.sample.generation;
        self.sample.generation = newest.generation;
        self.is_lent = true;
    }

    #[inline]
    fn copy(&mut self, newest: &Stamped<T>)
    where
        T: Copy,
    {
        let was_lent = self.is_lent;
        self.borrow(newest);
        self.is_lent = false;
        if self.is_new || was_lent {
            self.sample = *newest;
        }
    }

    #[inline(always)]
    fn record(&self) -> InputRecord {
        InputRecord { generation: self.sample.generation, taken: u16::from(self.is_new) }
    }
}

/// What a [`SamplesInput`] knows from one activation to the next.
#[doc(hidden)]
#[derive(Debug)]
pub struct SamplesPort<T, const N: usize> {
    /// The reading end's cursor, and what it has lost.
    position: (u32, u32),
    samples: Vec<Stamped<T>, N>,
}

impl<T, const N: usize> SamplesPort<T, N> {
    /// For the topic's reader of this number.
    #[inline(always)]
    pub fn __new<P, const W: usize, const R: usize>(topic: &Topic<T, P, N, W, R>, number: usize) -> Self
    where
        T: Message<Words = [u32; W]>,
    {
        Self { position: topic.__subscriber(number).position(), samples: Vec::new() }
    }
}

/// Every sample of a topic since the last activation, oldest first. A slice of [`Stamped`].
pub struct SamplesInput<'b, T, P, const N: usize, const W: usize> {
    ring: &'b Ring<N, W>,
    shared: Option<&'b AtomicU32>,
    port: &'b mut SamplesPort<T, N>,
    kind: core::marker::PhantomData<fn() -> P>,
}

// As of the newest sample.
impl<T: UnwindSafe, P, const N: usize, const W: usize> UnwindSafe for SamplesInput<'_, T, P, N, W> {}

impl<'b, T, P, const N: usize, const W: usize> SamplesInput<'b, T, P, N, W> {
    #[doc(hidden)]
    #[inline(always)]
    pub fn __new<const R: usize>(
        topic: &'b Topic<T, P, N, W, R>,
        number: usize,
        port: &'b mut SamplesPort<T, N>,
    ) -> Self {
        Self { ring: topic.ring(), shared: topic.cursor(number), port, kind: core::marker::PhantomData }
    }
}

impl<T, P, const N: usize, const W: usize> SamplesInput<'_, T, P, N, W>
where
    T: Message<Words = [u32; W]>,
    P: Sequential,
{
    /// Samples this runnable has missed because they were overwritten before it was activated.
    #[must_use]
    pub fn lost(&self) -> u32 {
        self.port.position.1
    }

    /// Reads, as part of an activation. More samples than the topic's depth stay for the next one.
    #[inline]
    pub fn read(&mut self, activation: &mut Activation) {
        let (position, lost) = self.port.position;
        if let Some(sought) = activation.position(InputRecord { generation: position, taken: 0 }) {
            let is_possible = self.ring.has_published(sought);
            if !is_possible {
                activation.misses();
            }
            let generation = if is_possible { sought } else { position };
            self.port.position = (generation, lost);
            if let Some(shared) = self.shared {
                shared.store(generation, crate::sync::Ordering::Release);
            }
            return;
        }
        let Some(input) = activation.recorded() else {
            activation.has_read(self.__look());
            return;
        };
        let port = &mut *self.port;
        port.samples.clear();
        let mut end = Subscriber::<T, P, N, W>::at(self.ring, self.shared, port.position);
        let mut generation = crate::ring::before(input.generation, input.taken);
        for _ in 0..input.taken {
            generation = crate::ring::next(generation);
            match end.at_generation(generation) {
                Some(sample) if port.samples.push(sample).is_ok() => {}
                _ => activation.misses(),
            }
        }
        port.position = end.position();
    }

    /// In flight: reads from the bus.
    // Inlined without what is seldom done: most topics are slower than the runnables that read them.
    #[doc(hidden)]
    #[inline(always)]
    pub fn __look(&mut self) -> InputRecord {
        let port = &mut *self.port;
        port.samples.clear();
        if self.ring.head() != port.position.0 {
            take_new::<T, P, N, W>(self.ring, self.shared, port);
        }
        InputRecord { generation: port.position.0, taken: port.samples.len() as u16 }
    }
}

#[inline(never)]
fn take_new<T: Message<Words = [u32; W]>, P: Sequential, const N: usize, const W: usize>(
    ring: &Ring<N, W>,
    shared: Option<&AtomicU32>,
    port: &mut SamplesPort<T, N>,
) {
    let mut end = Subscriber::<T, P, N, W>::at(ring, shared, port.position);
    while !port.samples.is_full() {
        let Some(sample) = end.next() else { break };
        // There is room.
        let _ = port.samples.push(sample);
    }
    port.position = end.position();
}

impl<T, P, const N: usize, const W: usize> Deref for SamplesInput<'_, T, P, N, W> {
    type Target = [Stamped<T>];

    #[inline]
    fn deref(&self) -> &[Stamped<T>] {
        &self.port.samples
    }
}
