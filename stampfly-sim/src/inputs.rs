//! What a vehicle is given during a flight, in order: the part of a recording that a golden flight is made of.
//!
//! Only what comes from outside is collected; everything else follows from it.

use stampfly_bus::{Schedule, TopicTable};
use stampfly_types::Instant;

/// What a vehicle was given.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// Somebody outside published.
    Sample {
        /// The topic.
        topic: usize,
        /// The sample's instant.
        at: Instant,
        /// The message.
        words: Vec<u32>,
    },
    /// The executor ran what was due.
    Turn(Instant),
}

/// Collects what a vehicle is given, in order.
#[derive(Clone, Debug, Default)]
pub struct Inputs {
    collected: Vec<Event>,
    turn: Option<Instant>,
}

impl Inputs {
    /// The executor is about to look what is due.
    pub(crate) fn turn(&mut self, clock: Instant) {
        self.turn = Some(clock);
    }

    /// Something was due.
    pub(crate) fn activation(&mut self) {
        self.collected.extend(self.turn.take().map(Event::Turn));
    }

    pub(crate) fn sample<R: Schedule>(&mut self, topic: usize, at: Instant, words: &[u32]) {
        if <R::Topics as TopicTable>::TOPICS.get(topic).is_some_and(|info| info.is_outside) {
            self.collected.push(Event::Sample { topic, at, words: words.to_vec() });
        }
    }

    /// What was collected.
    #[must_use]
    pub fn into_collected(self) -> Vec<Event> {
        self.collected
    }
}
