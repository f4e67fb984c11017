//! [`Schema`]: the topics and the activations that a log contains.

use super::Topic;
use crate::trace::ActivationTopic;

/// The topics and activations of a log, by number.
///
/// Implemented for a list of topics (`&[Topic]`) and for a pair of lists
/// (`(&[Topic], &[ActivationTopic])`). A vehicle's tables implement it directly, without making a
/// list.
pub trait Schema {
    /// The topic with this number; `None` after the last one.
    fn topic(&self, index: usize) -> Option<Topic>;

    /// The activations with this number; `None` after the last one.
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
