//! Typed topics: what a line of the topic table becomes.
//!
//! | policy | reader | when full | use for |
//! |---|---|---|---|
//! | [`Latest`] | newest value | older values are overwritten | estimates, modes: only now matters |
//! | [`Every`] (`ring(N)`) | every sample, own cursor | oldest is overwritten, each reader counts its losses | sensor samples |
//! | [`Lossless`] (`queue(N)`) | every sample, own cursor | the publisher gets the value back | commands |
//!
//! One publisher and any number of readers a topic; nobody waits for anybody. Declare topics with
//! [`topics!`](crate::topics!), which hands out every end exactly once.

use crate::ring::{Copied, Ring, next};
use crate::sync::{AtomicU32, Ordering, spin_loop, unless_loom_const};
use core::marker::PhantomData;
use stampfly_types::{Duration, Instant, Message};

/// A sample as a reader gets it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stamped<T> {
    /// The instant the data is valid for.
    pub at: Instant,
    /// The how-manieth sample of its topic this is, from one.
    pub generation: u32,
    /// The message.
    pub data: T,
}

impl<T> Stamped<T> {
    #[inline]
    pub(crate) fn from_copied<const W: usize>((generation, copied): (u32, Copied<W>)) -> Option<Self>
    where
        T: Message<Words = [u32; W]>,
    {
        Some(Self { at: copied.at, generation, data: T::from_words(&copied.words)? })
    }

    /// How old the data is at `now`; zero when it is stamped in the future.
    #[must_use]
    pub fn age(&self, now: Instant) -> Duration {
        now.since(self.at)
    }
}

/// Policy `latest`: only the newest value matters.
#[derive(Clone, Copy, Debug)]
pub struct Latest;
/// Policy `ring(N)`: every sample matters, the writer never waits.
#[derive(Clone, Copy, Debug)]
pub struct Every;
/// Policy `queue(N)`: no sample may be lost, the writer may be refused.
#[derive(Clone, Copy, Debug)]
pub struct Lossless;

/// A reader that is too slow makes a [`Lossless`] topic full. Holds the refused value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Full<T>(pub T);

/// Storage of one topic: policy `P`, `N` slots of `W` words, `R` readers whose cursors the writer must respect
/// (zero unless the policy is [`Lossless`]).
pub struct Topic<T, P, const N: usize, const W: usize, const R: usize> {
    ring: Ring<N, W>,
    cursors: [AtomicU32; R],
    kind: PhantomData<fn(T) -> P>,
}

impl<T: Message<Words = [u32; W]>, P, const N: usize, const W: usize, const R: usize> Topic<T, P, N, W, R> {
    unless_loom_const! {
        /// An empty topic.
        pub fn new() -> Self {
            Self { ring: Ring::new(), cursors: [const { AtomicU32::new(0) }; R], kind: PhantomData },
            Self { ring: Ring::new(), cursors: core::array::from_fn(|_| AtomicU32::new(0)), kind: PhantomData }
        }
    }

    /// Splits the topic into its publisher and `M` subscribers. The exclusive borrow is what makes a second
    /// publisher impossible.
    pub fn split<const M: usize>(&mut self) -> (Publisher<'_, T, P, N, W, R>, [Subscriber<'_, T, P, N, W>; M]) {
        let topic: &Self = self;
        let newest = topic.ring.head();
        let publisher = Publisher { topic, newest, hook: None };
        (publisher, core::array::from_fn(|index| topic.subscriber(index)))
    }

    fn subscriber(&self, index: usize) -> Subscriber<'_, T, P, N, W> {
        // A bus may have been in use before it was split: a reader starts with what is published from now on, or, where
        // nothing may be lost, with what was never taken.
        let shared = self.cursors.get(index);
        let cursor = shared.map_or_else(|| self.ring.head(), |cursor| cursor.load(Ordering::Relaxed));
        Subscriber { ring: &self.ring, shared, cursor, lost: 0, kind: PhantomData }
    }

    /// Makes the topic look as if it had been in use for long, `generation` being the newest sample. For tests.
    #[doc(hidden)]
    pub fn __age(&mut self, generation: u32) {
        self.ring.write(generation.wrapping_sub(1), Instant::ZERO, &[0; W]);
        for cursor in &self.cursors {
            cursor.store(generation, Ordering::Relaxed);
        }
    }

    #[doc(hidden)]
    pub fn __publisher(&self, hook: Option<Hook>, index: usize) -> Publisher<'_, T, P, N, W, R> {
        Publisher { topic: self, newest: self.ring.head(), hook: hook.map(|hook| (hook, index)) }
    }

    #[doc(hidden)]
    pub fn __subscriber(&self, index: usize) -> Subscriber<'_, T, P, N, W> {
        self.subscriber(index)
    }
}

impl<T: Message<Words = [u32; W]>, P, const N: usize, const W: usize, const R: usize> Default for Topic<T, P, N, W, R> {
    fn default() -> Self {
        Self::new()
    }
}

/// Called after every publish with the topic's index: an executor wakes its task here.
pub type Hook = fn(usize);

/// A topic without its types, for executors and tools.
pub trait AnyTopic: Sync {
    /// Newest generation, zero before the first.
    fn head(&self) -> u32;
    /// The instant the newest sample is valid for; `None` before the first.
    fn newest_at(&self) -> Option<Instant>;
}

impl<T, P, const N: usize, const W: usize, const R: usize> AnyTopic for Topic<T, P, N, W, R> {
    fn head(&self) -> u32 {
        self.ring.head()
    }

    fn newest_at(&self) -> Option<Instant> {
        newest(&self.ring).map(|(_, copied)| copied.at)
    }
}

/// The writing end of a topic. There is exactly one.
#[must_use = "a topic nobody publishes is a wiring error"]
pub struct Publisher<'b, T, P, const N: usize, const W: usize, const R: usize> {
    topic: &'b Topic<T, P, N, W, R>,
    newest: u32,
    hook: Option<(Hook, usize)>,
}

impl<T: Message<Words = [u32; W]>, P, const N: usize, const W: usize, const R: usize> Publisher<'_, T, P, N, W, R> {
    #[inline]
    fn write(&mut self, at: Instant, words: &[u32; W]) -> u32 {
        self.newest = self.topic.ring.write(self.newest, at, words);
        if let Some((hook, index)) = self.hook {
            hook(index);
        }
        self.newest
    }

    /// Generation of the newest sample, zero before the first.
    #[must_use]
    pub fn generation(&self) -> u32 {
        self.newest
    }

    /// Publishes a sample that is already in words, as a replay does. Words of the wrong number are refused.
    pub fn publish_words(&mut self, at: Instant, words: &[u32]) -> Option<u32> {
        let words: &[u32; W] = words.try_into().ok()?;
        T::from_words(words)?;
        Some(self.write(at, words))
    }
}

/// Policies under which the writer is never refused.
pub trait Overwriting {}
impl Overwriting for Latest {}
impl Overwriting for Every {}

impl<T: Message<Words = [u32; W]>, P: Overwriting, const N: usize, const W: usize, const R: usize>
    Publisher<'_, T, P, N, W, R>
{
    /// Publishes `data`, valid for the instant `at`. Returns its generation. Never waits, never fails.
    #[inline]
    pub fn publish(&mut self, at: Instant, data: &T) -> u32 {
        self.write(at, &data.to_words())
    }
}

impl<T: Message<Words = [u32; W]>, const N: usize, const W: usize, const R: usize> Publisher<'_, T, Lossless, N, W, R> {
    /// Publishes `data` unless the slowest reader has yet to take the sample it would overwrite.
    ///
    /// # Errors
    /// [`Full`] gives the value back.
    pub fn publish(&mut self, at: Instant, data: T) -> Result<u32, Full<T>> {
        let full = self.topic.cursors.iter().any(|cursor| {
            // Acquire: the reader has finished copying what it says it has taken. The distance is the one between the
            // sample to be written and the one to be read next, because generations skip zero when they wrap.
            next(self.newest).wrapping_sub(next(cursor.load(Ordering::Acquire))) >= N as u32
        });
        if full { Err(Full(data)) } else { Ok(self.write(at, &data.to_words())) }
    }
}

/// A reading end of a topic, with a cursor of its own.
#[must_use = "a reader that is dropped was named for nothing"]
pub struct Subscriber<'b, T, P, const N: usize, const W: usize> {
    ring: &'b Ring<N, W>,
    shared: Option<&'b AtomicU32>,
    cursor: u32,
    lost: u32,
    kind: PhantomData<fn(T) -> P>,
}

/// The newest complete sample. Each retry means the writer has published `N` samples during one copy.
#[inline]
fn newest<const N: usize, const W: usize>(ring: &Ring<N, W>) -> Option<(u32, Copied<W>)> {
    loop {
        let head = ring.head();
        if head == 0 {
            return None;
        }
        if let Some(copied) = ring.read(head) {
            return Some((head, copied));
        }
        spin_loop();
    }
}

impl<T: Message<Words = [u32; W]>, P, const N: usize, const W: usize> Subscriber<'_, T, P, N, W> {
    /// The newest sample, read or not; `None` before the first.
    #[inline]
    pub fn latest(&mut self) -> Option<Stamped<T>> {
        self.newest_copied().and_then(Stamped::from_copied)
    }

    /// The sample of this generation, if the ring still holds it. Moves the cursor there.
    pub fn at_generation(&mut self, generation: u32) -> Option<Stamped<T>> {
        self.copied_at(generation).and_then(Stamped::from_copied)
    }

    #[inline]
    pub(crate) fn newest_copied(&mut self) -> Option<(u32, Copied<W>)> {
        let (generation, copied) = newest(self.ring)?;
        self.advance(generation);
        Some((generation, copied))
    }

    pub(crate) fn copied_at(&mut self, generation: u32) -> Option<(u32, Copied<W>)> {
        // The sequence number alone could not tell a generation from the one 2³¹ later, nor 2³¹ from an empty slot.
        if generation == 0 || self.ring.head().wrapping_sub(generation) > N as u32 {
            return None;
        }
        let copied = self.ring.read(generation)?;
        self.advance(generation);
        Some((generation, copied))
    }

    /// Has anything been published since the last read?
    #[must_use]
    pub fn has_new(&self) -> bool {
        self.ring.head() != self.cursor
    }

    /// Generation of the last sample read, zero before the first.
    #[must_use]
    pub fn generation(&self) -> u32 {
        self.cursor
    }

    /// Samples this reader has missed by being overwritten.
    #[must_use]
    pub fn lost(&self) -> u32 {
        self.lost
    }

    #[inline]
    fn advance(&mut self, generation: u32) {
        self.cursor = generation;
        if let Some(shared) = self.shared {
            shared.store(generation, Ordering::Release);
        }
    }

    /// The next sample in order, as words. Skips and counts what was overwritten.
    #[inline]
    fn next_copied(&mut self) -> Option<(u32, Copied<W>)> {
        loop {
            let head = self.ring.head();
            let pending = head.wrapping_sub(self.cursor);
            if pending == 0 {
                return None;
            }
            if pending > N as u32 {
                let skipped = pending - N as u32;
                let oldest = self.cursor.wrapping_add(skipped);
                // There never was a generation zero to lose.
                let wrapped = u32::from(oldest < self.cursor);
                self.lost = self.lost.wrapping_add(skipped - wrapped);
                self.cursor = oldest;
            }
            let generation = next(self.cursor);
            if let Some(copied) = self.ring.read(generation) {
                self.advance(generation);
                return Some((generation, copied));
            }
            // Overwritten while we looked: the head has moved on, so the next round skips it.
            if self.ring.head() == head {
                // The writer is in the middle of exactly this slot; it counts as lost.
                self.lost = self.lost.wrapping_add(1);
                self.cursor = generation;
            }
            spin_loop();
        }
    }

    #[doc(hidden)]
    pub fn __next_words(&mut self, take: &mut dyn FnMut(Instant, u32, &[u32])) -> bool {
        match self.next_copied() {
            Some((generation, copied)) => {
                take(copied.at, generation, &copied.words);
                true
            }
            None => false,
        }
    }
}

/// Policies under which a reader sees every sample.
pub trait Sequential {}
impl Sequential for Every {}
impl Sequential for Lossless {}

impl<T: Message<Words = [u32; W]>, P: Sequential, const N: usize, const W: usize> Subscriber<'_, T, P, N, W> {
    /// The next sample in order; `None` when there is none. What was overwritten is skipped and counted in
    /// [`Self::lost`].
    #[inline]
    #[allow(clippy::should_implement_trait, reason = "a cursor, not an iterator: more may come after `None`")]
    pub fn next(&mut self) -> Option<Stamped<T>> {
        self.next_copied().and_then(Stamped::from_copied)
    }
}

/// Reads a topic for the log: every sample as words, whatever the policy.
pub struct Tap<'b, T, const N: usize, const W: usize>(Subscriber<'b, T, Every, N, W>);

impl<'b, T: Message<Words = [u32; W]>, const N: usize, const W: usize> Tap<'b, T, N, W> {
    #[doc(hidden)]
    pub fn __new<P, const R: usize>(topic: &'b Topic<T, P, N, W, R>) -> Self {
        Self(Subscriber { ring: &topic.ring, shared: None, cursor: topic.ring.head(), lost: 0, kind: PhantomData })
    }

    /// Hands every new sample to `take`: instant, generation, words.
    pub fn drain(&mut self, take: &mut dyn FnMut(Instant, u32, &[u32])) {
        while self.0.has_new() && self.0.__next_words(take) {}
    }

    /// Samples the tap has missed.
    #[must_use]
    pub fn lost(&self) -> u32 {
        self.0.lost()
    }
}
