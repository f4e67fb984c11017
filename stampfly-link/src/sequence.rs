//! Which datagrams are news: refuses those that are older than one heard before, and repetitions.

use stampfly_types::{Duration, Instant};

/// Refuses datagrams that are old or were heard before. One per sender and kind.
///
/// Sequence numbers wrap. A sender that was silent for the restart time may begin again with any number, so a program that
/// is started again is heard.
///
/// ```
/// use stampfly_link::SequenceFilter;
/// use stampfly_types::{Duration, Instant};
/// let mut filter = SequenceFilter::new(Duration::from_millis(200));
/// let at = Instant::from_millis;
/// assert!(filter.accept(at(0), u32::MAX) && filter.accept(at(10), 0), "wraps");
/// assert!(!filter.accept(at(20), 0), "a repetition");
/// assert!(filter.accept(at(500), 0), "restarted");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SequenceFilter {
    restart: Duration,
    last: Option<(u32, Instant)>,
}

impl SequenceFilter {
    /// A filter that has heard nothing yet. A sender silent for longer than `restart` counts as restarted.
    #[must_use]
    pub const fn new(restart: Duration) -> Self {
        Self { restart, last: None }
    }

    /// Is this sequence number, received at `now`, news?
    pub fn accept(&mut self, now: Instant, sequence: u32) -> bool {
        let news = self.last.is_none_or(|(last, at)| {
            let ahead = sequence.wrapping_sub(last);
            // Half of the numbers are ahead, half behind.
            (1..1 << 31).contains(&ahead) || now.since(at) > self.restart
        });
        if news {
            self.last = Some((sequence, now));
        }
        news
    }
}
