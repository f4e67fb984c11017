//! Collects the inputs of a flight in order: the content of a golden flight's record.
//!
//! Only samples published outside the runnables and the executor's turns are collected; all other
//! data follow from them.

use stampfly_bus::{Schedule, TopicTable};
use stampfly_types::Instant;

/// One input.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// A sample published outside the runnables.
    Sample {
        /// Index of the topic.
        topic: usize,
        /// The sample's instant.
        at: Instant,
        /// The message.
        words: Vec<u32>,
    },
    /// The executor ran due activations at this instant.
    Turn(Instant),
}

/// Collects the inputs of a flight.
#[derive(Clone, Debug, Default)]
pub struct Inputs {
    collected: Vec<Event>,
    turn: Option<Instant>,
}

impl Inputs {
    /// The executor is about to check which activations are due.
    pub(crate) fn turn(&mut self, clock: Instant) {
        self.turn = Some(clock);
    }

    /// An activation was due in this turn; turns without one are not collected.
    pub(crate) fn activation(&mut self) {
        self.collected.extend(self.turn.take().map(Event::Turn));
    }

    pub(crate) fn sample<R: Schedule>(&mut self, topic: usize, at: Instant, words: &[u32]) {
        if <R::Topics as TopicTable>::TOPICS.get(topic).is_some_and(|info| info.is_outside) {
            self.collected.push(Event::Sample { topic, at, words: words.to_vec() });
        }
    }

    /// The collected inputs.
    #[must_use]
    pub fn into_collected(self) -> Vec<Event> {
        self.collected
    }
}
