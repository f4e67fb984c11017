//! The black box: the last seconds of a flight, in memory, at a rate per topic.
//!
//! | part | what it does |
//! |---|---|
//! | [`BlackBox`] | records samples while the vehicle is armed and for [`TAIL`] after |
//! | [`Retention`] | which samples: a [`LogRate`] per topic |
//! | [`open`] | the head of the log as which it is read out |
//! | [`dump`] | the recording as that log in text, for a terminal |
//!
//! For vehicles that cannot write a log in flight (flash writes stall a microcontroller) and read the recording out after
//! landing. Samples are kept as the words that the bus moves; the oldest go when memory is full. Not for the analysis of a
//! whole flight: stream a log, or record on a host.

mod dump;
mod head;
mod retention;

pub use dump::{DumpError, DumpSink, Dumped, Refused, dump};
pub use head::open;
pub use retention::{KEEP_ALIVE, LogRate, MIN_INTERVAL, Retention, TAIL};

use crate::newest::{MAX_MESSAGE, longest_message};
use heapless::Vec;
use stampfly_types::Instant;

/// Words before those of a sample: topic and generation, instant.
const HEAD: usize = 2;

/// A recorded sample.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// The topic's place in the table.
    pub topic: usize,
    /// The instant the data is valid for.
    pub at: Instant,
    /// The lowest 24 bits of the sample's generation.
    pub generation: u32,
    /// The sample.
    pub words: Vec<u32, MAX_MESSAGE>,
}

/// A place in the recording. Valid until the recording changes.
#[derive(Clone, Copy, Debug)]
pub struct Cursor {
    offset: usize,
    changes: u32,
}

/// The recording has changed since the reading began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Changed;

/// The last seconds of a flight, in `WORDS` words of memory, for a vehicle of `TOPICS` topics.
///
/// Give it every sample of every topic. It starts afresh when the vehicle is armed, and ignores what a vehicle publishes
/// that has been disarmed for longer than [`TAIL`].
///
/// ```
/// # mod rover { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/flight/common/mod.rs")); }
/// use rover::topics::{self, Id}; // the rover of `tests/flight/common`
/// use stampfly_flight::black_box::{BlackBox, LogRate, Retention};
/// use stampfly_flight::newest::message;
/// use stampfly_types::messages::{FlightStatus, TofData};
/// use stampfly_types::{Instant, Message};
///
/// const RETENTION: Retention = Retention {
///     topics: &topics::TOPICS,
///     rate: |topic| if topic == Id::sensor_range as usize { LogRate::hertz(10) } else { LogRate::OnChange },
///     armed: |topic, words| {
///         (topic == Id::flight_status as usize).then(|| message::<FlightStatus>(words).is_some_and(|mode| mode.armed))
///     },
/// };
///
/// # fn main() {
/// let mut black_box = BlackBox::<256, { topics::COUNT }>::new(RETENTION);
/// let armed = FlightStatus { armed: true, ..Default::default() };
/// for millis in 0..400 {
///     let range = TofData { distance: 0.001 * millis as f32, valid: true, ..Default::default() };
///     let at = Instant::from_millis(millis);
///     black_box.note(Id::flight_status as usize, at, millis as u32, &armed.to_words());
///     black_box.note(Id::sensor_range as usize, at, millis as u32, &range.to_words());
/// }
/// let ranges = black_box.records().filter(|record| record.topic == Id::sensor_range as usize);
/// let kept: Vec<u64> = ranges.map(|record| record.at.as_micros() / 1_000).collect();
/// assert_eq!(kept, [0, 100, 200, 300]);
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct BlackBox<const WORDS: usize, const TOPICS: usize> {
    retention: Retention,
    memory: [u32; WORDS],
    /// Where the oldest record begins.
    oldest: usize,
    /// Words in use, from there on and round the end.
    used: usize,
    /// The instant of the newest record. Records hold the low half of theirs, which means the one within half an hour of
    /// this.
    newest: Instant,
    /// How often a sample was recorded or the recording started afresh.
    changes: u32,
    /// When the recording ends, unless the vehicle is armed then.
    until: Instant,
    /// When the last sample of each topic was kept, and its fingerprint.
    kept: [Option<(Instant, u32)>; TOPICS],
}

impl<const WORDS: usize, const TOPICS: usize> BlackBox<WORDS, TOPICS> {
    /// Nothing recorded.
    ///
    /// # Panics
    /// When the topic table has another length than `TOPICS`, or a message longer than [`MAX_MESSAGE`] or `WORDS`. In a
    /// `static` or `const`, that is a compile error.
    #[must_use]
    pub const fn new(retention: Retention) -> Self {
        const { assert!(TOPICS <= 0xFF, "a record has eight bits for its topic") }
        let longest = longest_message(retention.topics);
        assert!(retention.topics.len() == TOPICS, "another topic table");
        assert!(longest <= MAX_MESSAGE && longest + HEAD < WORDS, "no room for the longest message");
        Self {
            retention,
            memory: [0; WORDS],
            oldest: 0,
            used: 0,
            newest: Instant::ZERO,
            changes: 0,
            until: Instant::ZERO,
            kept: [None; TOPICS],
        }
    }

    /// Takes a sample of the topic at this place in the table, and records it when the vehicle is armed and the topic's
    /// rate allows.
    pub fn note(&mut self, topic: usize, at: Instant, generation: u32, words: &[u32]) {
        if self.retention.topics.get(topic).is_none_or(|info| info.words != words.len()) {
            return;
        }
        if (self.retention.armed)(topic, words) == Some(true) {
            if at >= self.until {
                (self.oldest, self.used, self.kept) = (0, 0, [None; TOPICS]);
                self.changes = self.changes.wrapping_add(1);
            }
            self.until = at + TAIL;
        }
        let Some(last) = self.kept.get_mut(topic) else { return };
        if at >= self.until {
            return;
        }
        let print = fingerprint(words);
        let kept = match ((self.retention.rate)(topic), *last) {
            (LogRate::Never, _) => return,
            (LogRate::EverySample, _) | (_, None) => at,
            (LogRate::AtMost(interval), Some((kept, _))) if at < kept + interval => return,
            // One sample in 40 ms is exactly that on average, whatever the topic's own period.
            (LogRate::AtMost(interval), Some((kept, _))) if at < kept + interval * 2 => kept + interval,
            (LogRate::AtMost(_), _) => at,
            (LogRate::OnChange, Some((kept, last_print))) => {
                if at < kept + if print == last_print { KEEP_ALIVE } else { MIN_INTERVAL } {
                    return;
                }
                at
            }
        };
        *last = Some((kept, print));
        self.record(topic, at, generation, words);
    }

    fn record(&mut self, topic: usize, at: Instant, generation: u32, words: &[u32]) {
        let length = HEAD + words.len();
        while self.used + length > WORDS {
            let Some(gone) = self.get(0).map(|oldest| HEAD + oldest.words.len()) else { return };
            (self.oldest, self.used) = (self.place(gone), self.used.saturating_sub(gone));
        }
        let head = [topic as u32 | generation << 8, at.as_micros() as u32];
        for word in head.iter().chain(words) {
            let place = self.place(self.used);
            if let Some(place) = self.memory.get_mut(place) {
                *place = *word;
            }
            self.used += 1;
        }
        (self.newest, self.changes) = (at, self.changes.wrapping_add(1));
    }

    /// The place in memory so many words after the oldest.
    const fn place(&self, offset: usize) -> usize {
        let place = self.oldest + offset;
        if place < WORDS { place } else { place - WORDS }
    }

    /// The record that begins so many words after the oldest.
    fn get(&self, offset: usize) -> Option<Record> {
        if offset >= self.used {
            return None;
        }
        let word = |index: usize| self.memory.get(self.place(offset + index)).copied().unwrap_or_default();
        let topic = (word(0) & 0xFF) as usize;
        let later = i64::from(word(1).wrapping_sub(self.newest.as_micros() as u32).cast_signed());
        let length = self.retention.topics.get(topic)?.words;
        let mut words = Vec::new();
        for index in HEAD..HEAD + length {
            words.push(word(index)).ok()?;
        }
        let at = Instant::from_micros(self.newest.as_micros().saturating_add_signed(later));
        Some(Record { topic, at, generation: word(0) >> 8, words })
    }

    /// The place of the oldest record.
    #[must_use]
    pub const fn begin(&self) -> Cursor {
        Cursor { offset: 0, changes: self.changes }
    }

    /// The record at this place, which moves on to the next; `None` behind the newest. For a task that cannot keep
    /// [`records`](Self::records) borrowed.
    ///
    /// # Errors
    /// When the recording has changed since [`begin`](Self::begin).
    pub fn next(&self, cursor: &mut Cursor) -> Result<Option<Record>, Changed> {
        if cursor.changes != self.changes {
            return Err(Changed);
        }
        let record = self.get(cursor.offset);
        cursor.offset += record.as_ref().map_or(0, |record| HEAD + record.words.len());
        Ok(record)
    }

    /// The recording, oldest first.
    pub fn records(&self) -> impl Iterator<Item = Record> {
        let mut cursor = self.begin();
        core::iter::from_fn(move || self.next(&mut cursor).ok().flatten())
    }
}

/// 32-bit FNV-1a over words: samples that differ in one word have different ones, others nearly always.
fn fingerprint(words: &[u32]) -> u32 {
    words.iter().fold(0x811C_9DC5, |hash, word| (hash ^ word).wrapping_mul(0x0100_0193))
}

#[cfg(test)]
mod tests;
