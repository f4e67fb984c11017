//! One activation of a runnable: what it saw, when, and what it could not publish.
//!
//! A runnable reads each input once, when it is activated, and publishes once, when it has finished. What it
//! publishes is a function of its state and of which samples it read. So the generations of those samples, a few
//! words an activation, are all a replay needs to reproduce a flight in which tasks interrupted each other
//! (AUTOSAR calls the discipline implicit communication; Kahn gave the argument in 1974).
//!
//! An [`Activation`] is that record. In flight it writes down what was read; in a replay it is filled in
//! beforehand and decides what is read.

use crate::ring::Copied;
use crate::topic::{Full, Lossless, Publisher, Sequential, Stamped, Subscriber};
use stampfly_types::{Instant, Message};

/// Most inputs one runnable can have.
pub const MAX_INPUTS: usize = 16;

/// What one activation read from one input.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InputRecord {
    /// Generation of the newest sample read, zero when there was none.
    pub generation: u32,
    /// How many samples were taken: 0 or 1 from [`Activation::latest`], any number from [`Activation::drain`].
    pub taken: u16,
}

/// A component adapter: reads its topics, steps one component, publishes.
///
/// `read` and `run` are separate because a task may be interrupted between them: whatever is published in between
/// belongs to the next activation.
pub trait Runnable {
    /// Copies every input, each exactly once and always in the same order.
    fn read(&mut self, activation: &mut Activation);

    /// Steps the component and publishes its outputs.
    fn run(&mut self, activation: &mut Activation);
}

/// One activation: its instant, what it read and what it was refused. In flight it writes this down, in a replay it
/// decides it.
#[derive(Clone, Debug, PartialEq)]
pub struct Activation {
    now: Instant,
    inputs: [InputRecord; MAX_INPUTS],
    count: usize,
    refused: u32,
    published: u32,
    replaying: bool,
    missing: bool,
}

impl Activation {
    /// An activation in flight, at the instant its trigger gives.
    #[must_use]
    pub fn live(now: Instant) -> Self {
        Self {
            now,
            inputs: [InputRecord { generation: 0, taken: 0 }; MAX_INPUTS],
            count: 0,
            refused: 0,
            published: 0,
            replaying: false,
            missing: false,
        }
    }

    /// An activation to repeat: same instant, same inputs, same refusals. More than [`MAX_INPUTS`] are ignored.
    #[must_use]
    pub fn replay(now: Instant, inputs: &[InputRecord], refused: u32) -> Self {
        let mut activation = Self { replaying: true, refused, ..Self::live(now) };
        for (place, input) in activation.inputs.iter_mut().zip(inputs) {
            *place = *input;
        }
        activation
    }

    /// The instant to compute for: the trigger's, never a clock's.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.now
    }

    /// What was read so far, in reading order.
    #[must_use]
    pub fn inputs(&self) -> &[InputRecord] {
        self.inputs.get(..self.count).unwrap_or(&self.inputs)
    }

    /// Bit k is set when the k-th lossless publish of this activation was refused.
    #[must_use]
    pub fn refused(&self) -> u32 {
        self.refused
    }

    /// In a replay: was a sample asked for that the bus no longer holds? Then the recording has a gap.
    #[must_use]
    pub fn is_missing_input(&self) -> bool {
        self.missing
    }

    #[inline]
    fn next_input(&mut self) -> Option<&mut InputRecord> {
        let input = self.inputs.get_mut(self.count);
        debug_assert!(input.is_some(), "a runnable has more than MAX_INPUTS inputs");
        self.count += 1;
        input
    }

    /// Reads the newest sample of a topic.
    #[inline]
    pub fn latest<T, P, const N: usize, const W: usize>(
        &mut self,
        from: &mut Subscriber<'_, T, P, N, W>,
    ) -> Option<Stamped<T>>
    where
        T: Message<Words = [u32; W]>,
    {
        self.newest_copied(from).and_then(Stamped::from_copied)
    }

    /// Reads the newest sample of a topic into `into`, which stays as it is while there is none.
    #[inline]
    pub fn update<T, P, const N: usize, const W: usize>(&mut self, from: &mut Subscriber<'_, T, P, N, W>, into: &mut T)
    where
        T: Message<Words = [u32; W]>,
    {
        if let Some(data) = self.newest_copied(from).and_then(|(_, copied)| T::from_words(&copied.words)) {
            *into = data;
        }
    }

    #[inline]
    fn newest_copied<T, P, const N: usize, const W: usize>(
        &mut self,
        from: &mut Subscriber<'_, T, P, N, W>,
    ) -> Option<(u32, Copied<W>)>
    where
        T: Message<Words = [u32; W]>,
    {
        let replaying = self.replaying;
        let input = self.next_input()?;
        let sample = match (replaying, input.taken) {
            (false, _) => from.newest_copied(),
            (true, 0) => None,
            (true, _) => from.copied_at(input.generation),
        };
        if replaying {
            self.missing |= sample.is_none() && self.inputs.get(self.count - 1).is_some_and(|i| i.taken > 0);
        } else {
            *input = InputRecord {
                generation: sample.as_ref().map_or(0, |(generation, _)| *generation),
                taken: u16::from(sample.is_some()),
            };
        }
        sample
    }

    /// Takes the samples of a topic since the last activation, oldest first, as many as fit into `into`, which is
    /// cleared first. What does not fit stays for the next activation.
    #[inline]
    pub fn drain<T, P, const N: usize, const W: usize, const M: usize>(
        &mut self,
        from: &mut Subscriber<'_, T, P, N, W>,
        into: &mut heapless::Vec<Stamped<T>, M>,
    ) where
        T: Message<Words = [u32; W]>,
        P: Sequential,
    {
        into.clear();
        let replaying = self.replaying;
        let Some(input) = self.next_input() else { return };
        if replaying {
            let (last, taken) = (input.generation, input.taken);
            for back in (0..u32::from(taken)).rev() {
                match from.at_generation(last.wrapping_sub(back)) {
                    Some(sample) if into.push(sample).is_ok() => {}
                    _ => self.missing = true,
                }
            }
            return;
        }
        while !into.is_full() {
            let Some(sample) = from.next() else { break };
            // Cannot fail: there is room.
            let _ = into.push(sample);
        }
        *input = InputRecord { generation: from.generation(), taken: into.len() as u16 };
    }

    /// Publishes on a lossless topic and writes down a refusal, so that a replay refuses too.
    ///
    /// # Errors
    /// [`Full`] gives the value back.
    pub fn offer<T, const N: usize, const W: usize, const R: usize>(
        &mut self,
        to: &mut Publisher<'_, T, Lossless, N, W, R>,
        data: T,
    ) -> Result<u32, Full<T>>
    where
        T: Message<Words = [u32; W]>,
    {
        let bit = 1u32.checked_shl(self.published).unwrap_or(0);
        self.published += 1;
        if self.replaying && self.refused & bit != 0 {
            return Err(Full(data));
        }
        let result = to.publish(self.now, data);
        if result.is_err() {
            self.refused |= bit;
        }
        result
    }
}
