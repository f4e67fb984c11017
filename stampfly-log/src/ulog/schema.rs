//! What a log is about: the topics whose samples it holds, and the runnables whose activations it holds.

use super::Topic;
use crate::trace::ActivationTopic;

/// The topics and activations of a log, by number.
///
/// A list of topics is a schema (`&[Topic]`), a pair of lists is one (`(&[Topic], &[ActivationTopic])`), and a vehicle's
/// tables are one without a list being made of them.
pub trait Schema {
    /// The topic with this number; `None` behind the last.
    fn topic(&self, index: usize) -> Option<Topic>;

    /// The activations with this number; `None` behind the last.
    fn activation(&self, _index: usize) -> Option<ActivationTopic> {
        None
    }
}

impl Schema for &[Topic] {
    fn topic(&self, index: usize) -> Option<Topic> {
        self.get(index).copied()
    }
}

impl Schema for (&[Topic], &[ActivationTopic]) {
    fn topic(&self, index: usize) -> Option<Topic> {
        self.0.get(index).copied()
    }

    fn activation(&self, index: usize) -> Option<ActivationTopic> {
        self.1.get(index).copied()
    }
}
