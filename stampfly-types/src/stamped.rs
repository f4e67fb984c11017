//! [`Stamped`]: a message with the instant it is valid for, as returned by readers of the bus.

use crate::{Duration, Instant};

/// A sample: a message, the instant it is valid for, and its number on its topic.
///
/// ```
/// use stampfly_types::{Duration, Instant, Stamped};
/// let range = Stamped { at: Instant::from_millis(40), generation: 7, data: 0.31 };
/// assert_eq!(range.age(Instant::from_millis(42)), Duration::from_millis(2));
/// assert_eq!(range.age(Instant::from_millis(39)), Duration::ZERO);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Stamped<T> {
    /// The instant the data is valid for.
    pub at: Instant,
    /// Sequence number of the sample on its topic, starting at 1.
    pub generation: u32,
    /// The message.
    pub data: T,
}

impl<T> Stamped<T> {
    /// Age of the data at `now`; zero when its stamp is in the future.
    #[inline]
    #[must_use]
    pub fn age(&self, now: Instant) -> Duration {
        now.since(self.at)
    }
}
