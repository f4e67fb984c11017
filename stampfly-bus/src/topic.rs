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

pub use crate::ring::InPlace;
use crate::ring::{Copied, Ring, next};
use crate::sync::{AtomicU32, Ordering, spin_loop, unless_loom_const};
use core::marker::PhantomData;
use stampfly_types::{Instant, Message, Stamped};

/// A sample from its words; `None` when they are none of the message.
#[inline]
fn stamped<T: Message<Words = [u32; W]>, const W: usize>((generation, copied): (u32, Copied<W>)) -> Option<Stamped<T>> {
    Some(Stamped { at: copied.at, generation, data: T::from_words(&copied.words)? })
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

    #[inline(always)]
    fn subscriber(&self, index: usize) -> Subscriber<'_, T, P, N, W> {
        // A bus may have been in use before it was split: a reader starts with what is published from now on, or, where
        // nothing may be lost, with what was never taken.
        let shared = self.cursor(index);
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

    // Inlined with all that makes ends: a vehicle's are thousands of bytes, to be made in their place, not moved there.
    #[doc(hidden)]
    #[inline(always)]
    pub fn __publisher(&self, hook: Option<Hook>, index: usize) -> Publisher<'_, T, P, N, W, R> {
        Publisher { topic: self, newest: self.ring.head(), hook: hook.map(|hook| (hook, index)) }
    }

    #[doc(hidden)]
    #[inline(always)]
    pub fn __subscriber(&self, index: usize) -> Subscriber<'_, T, P, N, W> {
        self.subscriber(index)
    }
}

impl<T, P, const N: usize, const W: usize, const R: usize> Topic<T, P, N, W, R> {
    #[inline(always)]
    pub(crate) const fn ring(&self) -> &Ring<N, W> {
        &self.ring
    }

    /// The cursor of this reader, if the writer must respect it.
    #[inline(always)]
    pub(crate) fn cursor(&self, reader: usize) -> Option<&AtomicU32> {
        self.cursors.get(reader)
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
    /// The same, to be looked at again and again.
    fn counter(&self) -> Head<'_>;
    /// Number of slots.
    fn depth(&self) -> usize;
    /// Hands the words of this sample to `take`. Returns whether the topic still holds it.
    fn copy(&self, generation: u32, take: &mut dyn FnMut(Instant, &[u32])) -> bool;
    /// This sample where it lies, for whoever copies it himself. `None` when the topic does not hold it.
    fn in_place(&self, generation: u32) -> Option<InPlace<'_>>;
}

impl<T, P, const N: usize, const W: usize, const R: usize> AnyTopic for Topic<T, P, N, W, R> {
    fn head(&self) -> u32 {
        self.ring.head()
    }

    fn newest_at(&self) -> Option<Instant> {
        retry_at_head(&self.ring, Ring::stamp).map(|(_, at)| at)
    }

    fn counter(&self) -> Head<'_> {
        Head(self.ring.counter())
    }

    fn depth(&self) -> usize {
        N
    }

    fn copy(&self, generation: u32, take: &mut dyn FnMut(Instant, &[u32])) -> bool {
        let copied = if generation == 0 { None } else { self.ring.read(generation) };
        copied.is_some_and(|copied| {
            take(copied.at, &copied.words);
            true
        })
    }

    fn in_place(&self, generation: u32) -> Option<InPlace<'_>> {
        self.ring.in_place(generation)
    }
}

/// Newest generation of a topic, for whoever looks very often: a load, where [`AnyTopic::head`] is a call.
#[derive(Clone, Copy)]
pub struct Head<'b>(&'b AtomicU32);

impl Head<'_> {
    /// Newest generation, zero before the first.
    #[inline]
    #[must_use]
    pub fn newest(self) -> u32 {
        self.0.load(Ordering::Acquire)
    }

    /// Is another generation than this one the newest? Orders nothing: ask [`newest`](Self::newest) before reading the sample.
    #[inline(always)]
    #[must_use]
    pub fn has_moved(self, from: u32) -> bool {
        self.0.load(Ordering::Relaxed) != from
    }

    /// The generation that comes after this one: zero is none.
    #[inline(always)]
    #[must_use]
    pub const fn after(generation: u32) -> u32 {
        next(generation)
    }
}

/// The writing end of a topic. There is exactly one.
#[must_use = "a topic nobody publishes is a wiring mistake"]
pub struct Publisher<'b, T, P, const N: usize, const W: usize, const R: usize> {
    topic: &'b Topic<T, P, N, W, R>,
    newest: u32,
    hook: Option<(Hook, usize)>,
}

impl<T: Message<Words = [u32; W]>, P, const N: usize, const W: usize, const R: usize> Publisher<'_, T, P, N, W, R> {
    #[inline]
    pub(crate) fn write(&mut self, at: Instant, words: &[u32; W]) -> u32 {
        self.newest = self.topic.ring.write(self.newest, at, words);
        if let Some((hook, index)) = self.hook {
            hook(index);
        }
        self.newest
    }

    /// Generation of the newest sample, zero before the first.
    #[must_use]
    pub const fn generation(&self) -> u32 {
        self.newest
    }

    /// Publishes without asking whether a reader would lose a sample.
    #[inline]
    pub(crate) fn publish_unchecked(&mut self, at: Instant, data: &T) -> u32 {
        self.write(at, &data.to_words())
    }

    /// Puts a sample back where it was: the topic's newest is this generation from now on. `None`, and nothing changes,
    /// when these are no words of the topic's message or the generation is zero.
    pub fn restore_words(&mut self, at: Instant, generation: u32, words: &[u32]) -> Option<()> {
        let words: &[u32; W] = words.try_into().ok().filter(|_| generation != 0)?;
        T::from_words(words)?;
        self.newest = self.topic.ring.write(crate::ring::before(generation, 1), at, words);
        Some(())
    }

    /// Publishes a sample that is already in words, as a replay does. A full queue does not refuse it. `None` when these
    /// are no words of the topic's message.
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

/// What `read` finds at the newest complete sample. Each retry means the writer has published `N` samples meanwhile.
#[inline]
fn retry_at_head<const N: usize, const W: usize, V>(
    ring: &Ring<N, W>,
    read: impl Fn(&Ring<N, W>, u32) -> Option<V>,
) -> Option<(u32, V)> {
    loop {
        let head = ring.head();
        if head == 0 {
            return None;
        }
        if let Some(value) = read(ring, head) {
            return Some((head, value));
        }
        spin_loop();
    }
}

impl<'b, T, P, const N: usize, const W: usize> Subscriber<'b, T, P, N, W> {
    /// One that goes on where another was: that one's [`position`](Self::position).
    #[inline(always)]
    pub(crate) const fn at(ring: &'b Ring<N, W>, shared: Option<&'b AtomicU32>, (cursor, lost): (u32, u32)) -> Self {
        Self { ring, shared, cursor, lost, kind: PhantomData }
    }

    /// Its cursor, and how much it has lost.
    #[inline(always)]
    pub(crate) const fn position(&self) -> (u32, u32) {
        (self.cursor, self.lost)
    }
}

impl<T: Message<Words = [u32; W]>, P, const N: usize, const W: usize> Subscriber<'_, T, P, N, W> {
    /// The newest sample, read or not; `None` before the first.
    #[inline]
    pub fn latest(&mut self) -> Option<Stamped<T>> {
        self.newest_copied().and_then(stamped)
    }

    /// The sample of this generation, if the ring still holds it. Moves the cursor there.
    pub fn at_generation(&mut self, generation: u32) -> Option<Stamped<T>> {
        let copied = self.copied_at(generation)?;
        stamped((generation, copied))
    }

    /// Copies the newest sample to where it is looked at. `false` before the first.
    #[inline]
    pub(crate) fn latest_into(&mut self, into: &mut Stamped<T>) -> bool {
        let newest = self.newest_copied();
        Self::place(newest, into)
    }

    /// The same with the sample of this generation. `false` when the ring does not hold it.
    #[inline]
    pub(crate) fn generation_into(&mut self, generation: u32, into: &mut Stamped<T>) -> bool {
        let copied = self.copied_at(generation).map(|copied| (generation, copied));
        Self::place(copied, into)
    }

    #[inline]
    fn place(copied: Option<(u32, Copied<W>)>, into: &mut Stamped<T>) -> bool {
        copied.and_then(stamped).map(|sample| *into = sample).is_some()
    }

    #[inline]
    fn newest_copied(&mut self) -> Option<(u32, Copied<W>)> {
        let (generation, copied) = retry_at_head(self.ring, Ring::read)?;
        self.advance(generation);
        Some((generation, copied))
    }

    fn copied_at(&mut self, generation: u32) -> Option<Copied<W>> {
        // The sequence number alone could not tell a generation from the one 2³¹ later, nor 2³¹ from an empty slot.
        if generation == 0 || self.ring.head().wrapping_sub(generation) > N as u32 {
            return None;
        }
        let copied = self.ring.read(generation)?;
        self.advance(generation);
        Some(copied)
    }

    /// Has anything been published since the last read?
    #[inline]
    #[must_use]
    pub fn has_new(&self) -> bool {
        self.ring.head() != self.cursor
    }

    /// Generation of the last sample read, zero before the first.
    #[inline]
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
        self.next_copied().and_then(stamped)
    }
}

/// Reads a topic for the log: every sample as words, whatever the policy.
pub struct Tap<'b, T, const N: usize, const W: usize>(Subscriber<'b, T, Every, N, W>);

impl<'b, T: Message<Words = [u32; W]>, const N: usize, const W: usize> Tap<'b, T, N, W> {
    #[doc(hidden)]
    #[inline(always)]
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
