//! Destinations of a log, and errors of writing.

use super::MAX_MESSAGE;
use core::fmt;

/// Destination of a log.
///
/// # Contract
/// * `write` takes all of `bytes` or, with an error, none of them.
/// * The first call gets the file header; every other call gets one whole message of at most
///   [`MAX_MESSAGE`] bytes. A sink may therefore refuse a message without corrupting the log.
pub trait Sink {
    /// The sink's error.
    type Error;

    /// Takes the next bytes of the log.
    ///
    /// # Errors
    /// When there is no room or the medium fails.
    fn write(&mut self, bytes: &[u8]) -> Result<(), Self::Error>;
}

impl<S: Sink> Sink for &mut S {
    type Error = S::Error;
    fn write(&mut self, bytes: &[u8]) -> Result<(), S::Error> {
        (**self).write(bytes)
    }
}

/// A sink in memory. Refuses messages when it is full.
#[derive(Debug)]
pub struct Ram<'a> {
    memory: &'a mut [u8],
    used: usize,
}

/// The memory of a [`Ram`] has no room for this message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Full;

impl fmt::Display for Full {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the log's memory is full")
    }
}

impl core::error::Error for Full {}

impl<'a> Ram<'a> {
    /// An empty log in this memory.
    pub fn new(memory: &'a mut [u8]) -> Self {
        Self { memory, used: 0 }
    }

    /// The log written so far.
    #[must_use]
    pub fn written(&self) -> &[u8] {
        self.memory.get(..self.used).unwrap_or_default()
    }
}

impl Sink for Ram<'_> {
    type Error = Full;
    fn write(&mut self, bytes: &[u8]) -> Result<(), Full> {
        let end = self.used + bytes.len();
        self.memory.get_mut(self.used..end).ok_or(Full)?.copy_from_slice(bytes);
        self.used = end;
        Ok(())
    }
}

/// Reason why a message was not written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum WriteError<E> {
    /// The sink refused the message.
    Sink(E),
    /// The message is longer than [`MAX_MESSAGE`].
    TooLong,
    /// More topics than a log can number.
    TooManyTopics,
    /// The schema has no such topic or activation.
    UnknownTopic,
    /// The number of words or inputs differs from the topic's.
    WordCount,
    /// A word is out of range for the field of this name.
    OutOfRange(&'static str),
    /// Two topics of this name have different fields, so they cannot be instances of one topic.
    TwoFormats(&'static str),
}

impl<E: fmt::Display> fmt::Display for WriteError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sink(error) => error.fmt(f),
            Self::TooLong => write!(f, "the message is longer than {MAX_MESSAGE} bytes"),
            Self::TooManyTopics => f.write_str("more topics than a log can number"),
            Self::UnknownTopic => f.write_str("the topic was not declared"),
            Self::WordCount => f.write_str("the sample has not the size of its topic"),
            Self::OutOfRange(field) => write!(f, "a word does not fit into field `{field}`"),
            Self::TwoFormats(topic) => write!(f, "two topics `{topic}` have different fields"),
        }
    }
}

impl<E: fmt::Display + fmt::Debug> core::error::Error for WriteError<E> {}
