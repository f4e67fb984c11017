//! What follows from a topic table: names and schemas as data, and the table as a trait.
//!
//! [`topics!`](crate::topics!) generates an `impl` of [`TopicTable`]; code that works for any vehicle (an executor, a
//! recorder, a replay) is generic over it and never names a topic.

use crate::topic::{AnyTopic, Hook};
use stampfly_types::{Duration, FieldInfo, Instant};

/// What a line of the topic table says, for tools: the command line, the log, the documentation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TopicInfo {
    /// Name of the topic.
    pub name: &'static str,
    /// Its documentation, line by line.
    pub doc: &'static [&'static str],
    /// Type name of its message.
    pub message: &'static str,
    /// `latest`, `ring` or `queue`.
    pub policy: &'static str,
    /// Number of slots.
    pub depth: usize,
    /// Nominal rate as written in the table, such as `400 Hz` or `on event`.
    pub rate: &'static str,
    /// Time between two samples at that rate; `None` when they come on events.
    pub period: Option<Duration>,
    /// Who publishes it.
    pub publisher: &'static str,
    /// Is the publisher outside, not a runnable? Then the samples are inputs of a flight, and a replay needs them.
    pub is_outside: bool,
    /// Who reads it. The log's tap reads every topic and is not listed.
    pub readers: &'static [&'static str],
    /// Words per sample.
    pub words: usize,
    /// Schema of the message.
    pub fields: &'static [FieldInfo],
}

/// Slots of a `latest` topic. Readers ask only for the newest; the others let the log's tap, which comes round every few
/// milliseconds, miss nothing.
pub const LATEST_DEPTH: usize = 8;

/// A vehicle's topic table. Implemented by the `Bus` that [`topics!`](crate::topics!) generates.
pub trait TopicTable: Sized + 'static {
    /// The table itself.
    const TOPICS: &'static [TopicInfo];
    /// The ends of every runnable.
    type Ends<'b>: PublishWords;
    /// The ends of everybody outside: drivers, links, motors.
    type Outside<'b>: PublishWords;
    /// The log's cursors.
    type Taps<'b>: Taps;
    /// Every topic without its type, in the table's order.
    type Heads<'b>: AsRef<[&'b dyn AnyTopic]>;

    /// A bus on which nothing has been published.
    fn new() -> Self;

    /// Hands out every end once. `hook` is called after every publish.
    fn split(&mut self, hook: Option<Hook>) -> Split<'_, Self>;
}

/// Everything a bus is split into.
pub struct Split<'b, T: TopicTable> {
    /// The ends of every runnable.
    pub runnables: T::Ends<'b>,
    /// The ends of everybody outside.
    pub outside: T::Outside<'b>,
    /// The log's cursors.
    pub taps: T::Taps<'b>,
    /// Every topic without its type, in the table's order.
    pub heads: T::Heads<'b>,
}

/// The log's cursors: one a topic, whatever its policy. They respect no one and count what they miss.
pub trait Taps {
    /// Hands every new sample of every topic to `take`: place in the table, instant, generation, words.
    fn drain(&mut self, take: &mut dyn FnMut(usize, Instant, u32, &[u32]));

    /// Samples missed so far, over all topics.
    fn lost(&self) -> u32;
}

/// Publishing without types, as a replay does: by the topic's place in the table.
pub trait PublishWords {
    /// Publishes a sample that is in words already. Returns its generation; `None` when the topic's publisher is not
    /// among these ends, or the words are none of the topic's messages. A full queue does not refuse it.
    fn publish_words(&mut self, topic: usize, at: Instant, words: &[u32]) -> Option<u32>;

    /// Puts a sample back where it was: the topic's newest is this generation from now on. Restore the samples of a topic
    /// oldest first. `None` as for [`publish_words`](Self::publish_words).
    fn restore_words(&mut self, topic: usize, at: Instant, generation: u32, words: &[u32]) -> Option<()>;
}
