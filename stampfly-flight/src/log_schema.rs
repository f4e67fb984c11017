//! A vehicle's tables as the log wants them: every topic and every activation, and topics beside the bus.

use core::marker::PhantomData;
use stampfly_bus::{Schedule, TopicTable};
use stampfly_log::ActivationTopic;
use stampfly_log::ulog::{Schema, Topic};

/// The schema of a vehicle's log: the bus's topics in the table's order, then `beside` (a simulator's truth, say), then
/// one topic per activation.
pub struct LogSchema<R> {
    beside: &'static [Topic],
    vehicle: PhantomData<fn() -> R>,
}

impl<R> Clone for LogSchema<R> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<R> Copy for LogSchema<R> {}

impl<R: Schedule> LogSchema<R> {
    /// Topics, and those beside the bus.
    #[must_use]
    pub const fn new(beside: &'static [Topic]) -> Self {
        Self { beside, vehicle: PhantomData }
    }

    /// The place of the first topic beside the bus.
    pub const BESIDE: usize = <R::Topics as TopicTable>::TOPICS.len();
}

impl<R: Schedule> Schema for LogSchema<R> {
    fn topic(&self, index: usize) -> Option<Topic> {
        let of_the_bus = <R::Topics as TopicTable>::TOPICS.get(index);
        of_the_bus
            .map(|info| Topic { name: info.name, fields: info.fields })
            .or_else(|| self.beside.get(index.checked_sub(Self::BESIDE)?).copied())
    }

    fn activation(&self, index: usize) -> Option<ActivationTopic> {
        let (info, inputs) = (R::ACTIVATIONS.get(index)?, *R::INPUTS.get(index)?);
        Some(ActivationTopic { name: info.name, index: index as u8, inputs })
    }
}
