//! Which samples of a flight the black box keeps: a rate per topic, and what arms the vehicle.

use stampfly_bus::TopicInfo;
use stampfly_types::Duration;

/// How many samples of a topic are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogRate {
    /// None: what can be computed from other topics, or ended before the flight.
    Never,
    /// All of them: for events.
    EverySample,
    /// One in this time, for measurements. [`LogRate::hertz`] makes one of a rate.
    AtMost(Duration),
    /// For states: a sample that differs from the last one kept, [`MIN_INTERVAL`] after it at the earliest; and an equal
    /// one every [`KEEP_ALIVE`].
    OnChange,
}

impl LogRate {
    /// So many samples a second at most; zero is [`Never`](Self::Never).
    #[must_use]
    pub const fn hertz(rate: u32) -> Self {
        match 1_000_000u32.checked_div(rate) {
            Some(micros) => Self::AtMost(Duration::from_micros(micros as u64)),
            None => Self::Never,
        }
    }
}

/// A topic that is kept on change is kept at this interval at most, so that one that changes all the time leaves memory
/// to the others.
pub const MIN_INTERVAL: Duration = Duration::from_millis(20);
/// A topic that is kept on change is kept this often while it does not change.
pub const KEEP_ALIVE: Duration = Duration::from_secs(1);
/// Recording goes on for this long after the vehicle was disarmed: a vehicle that has crashed shows by then where it lies.
pub const TAIL: Duration = Duration::from_millis(250);

/// What a vehicle tells its black box.
#[derive(Clone, Copy, Debug)]
pub struct Retention {
    /// The topic table.
    pub topics: &'static [TopicInfo],
    /// How many samples to keep of the topic at this place in the table.
    pub rate: fn(topic: usize) -> LogRate,
    /// Whether the vehicle is armed according to this sample; `None` when the topic says nothing about it.
    pub armed: fn(topic: usize, words: &[u32]) -> Option<bool>,
}
