//! The black box: the last seconds of a flight, in memory, as many samples as fit.
//!
//! | part | what it does |
//! |---|---|
//! | [`BlackBox`] | remembers samples while the vehicle is armed, and a moment longer |
//! | [`keep`] | which samples of each topic |
//! | [`open`] | starts the log that they go into |
//! | [`dump`] | the log as text, for a terminal |
//!
//! Flash cannot be written in flight, so the vehicle remembers in RAM and tells after landing. Samples are kept as the
//! words the bus moves; when there is no room the oldest go. Not for analysis of a whole flight: the log of a host, which
//! has room, keeps all.

mod dump;
mod keep;
mod log;

pub use dump::{DumpError, Dumped, Refused, dump};
pub use keep::{HASTE, Keep, REMINDER, keep};
pub use log::{head, open};

use crate::wiring;
use stampfly_types::messages::SystemMode;
use stampfly_types::{Duration, Instant, Message};

/// Remembering goes on for this long after the motors have stopped: what is lying upside down shows by then.
pub const AFTERMATH: Duration = Duration::from_millis(250);

/// Words a StampFly has for it: 40 kB, which are more than five seconds.
pub const ROOM: usize = 10 * 1024;

/// Words before those of a sample: topic and generation, instant.
const HEAD: usize = 2;
/// Words of the longest message.
pub(crate) const LONGEST: usize = {
    let (mut longest, mut index) = (0, 0);
    while index < wiring::COUNT {
        if wiring::TOPICS[index].words > longest {
            longest = wiring::TOPICS[index].words;
        }
        index += 1;
    }
    longest
};

/// A remembered sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Record {
    /// Line of the topic table.
    pub topic: usize,
    /// The instant the data is valid for.
    pub at: Instant,
    /// The lowest 24 bits of the topic's running number of this sample.
    pub generation: u32,
    words: [u32; LONGEST],
    length: usize,
}

impl Record {
    /// The sample's words.
    #[must_use]
    pub fn words(&self) -> &[u32] {
        self.words.get(..self.length).unwrap_or_default()
    }
}

/// A place among what is remembered. Worth nothing any more when something was remembered or forgotten since.
#[derive(Clone, Copy, Debug)]
pub struct Cursor {
    offset: usize,
    changes: u32,
}

/// Something was remembered or forgotten since the reading began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Changed;

/// The last seconds of a flight, in `WORDS` words of memory.
///
/// Wants every sample of every topic. It begins anew when the vehicle is armed, and takes nothing on a vehicle that has
/// been disarmed for longer than [`AFTERMATH`].
///
/// ```
/// use stampfly_board::{black_box::BlackBox, wiring};
/// use stampfly_types::messages::{SystemMode, TofData};
/// use stampfly_types::{Instant, Message};
/// let mut black_box = BlackBox::<256>::new();
/// let armed = SystemMode { armed: true, ..Default::default() };
/// for millis in 0..400 {
///     let range = TofData { distance: 0.001 * millis as f32, valid: true, ..Default::default() };
///     let at = Instant::from_millis(millis);
///     black_box.note(wiring::Id::system_mode, at, millis as u32, &armed.to_words());
///     black_box.note(wiring::Id::sensor_tof, at, millis as u32, &range.to_words());
/// }
/// let ranges = black_box.records().filter(|record| record.topic == wiring::Id::sensor_tof as usize);
/// let kept: Vec<u64> = ranges.map(|record| record.at.as_micros() / 1_000).collect();
/// assert_eq!(kept, [0, 100, 200, 300]);
/// ```
#[derive(Clone, Debug)]
pub struct BlackBox<const WORDS: usize> {
    memory: [u32; WORDS],
    /// Where the oldest record begins.
    oldest: usize,
    /// Words in use, from there on and round the end.
    used: usize,
    /// The instant of the newest record. Records have the low half of theirs, which means one within half an hour of it.
    newest: Instant,
    /// How often something was remembered or forgotten.
    changes: u32,
    /// Until when the flight is worth remembering.
    until: Instant,
    /// When the last sample of each topic was kept.
    kept: [Option<Instant>; wiring::COUNT],
    /// The fingerprint of it.
    last: [u32; wiring::COUNT],
}

impl<const WORDS: usize> BlackBox<WORDS> {
    /// Nothing remembered.
    #[must_use]
    #[allow(clippy::new_without_default, reason = "`const`, for a static in firmware")]
    pub const fn new() -> Self {
        const { assert!(WORDS > HEAD + LONGEST, "no room for the longest message") }
        Self {
            memory: [0; WORDS],
            oldest: 0,
            used: 0,
            newest: Instant::ZERO,
            changes: 0,
            until: Instant::ZERO,
            kept: [None; wiring::COUNT],
            last: [0; wiring::COUNT],
        }
    }

    /// Takes a sample, and remembers it if the vehicle flies and [`keep`] says so.
    pub fn note(&mut self, topic: wiring::Id, at: Instant, generation: u32, words: &[u32]) {
        if topic == wiring::Id::system_mode && is_armed(words) {
            if at >= self.until {
                (self.oldest, self.used, self.kept) = (0, 0, [None; wiring::COUNT]);
                self.changes = self.changes.wrapping_add(1);
            }
            self.until = at + AFTERMATH;
        }
        if at < self.until && self.wants(topic, at, words) {
            self.remember(topic, at, generation, words);
        }
    }

    fn wants(&self, topic: wiring::Id, at: Instant, words: &[u32]) -> bool {
        let Some(kept) = self.kept.get(topic as usize).copied().flatten() else { return keep(topic) != Keep::Never };
        match keep(topic) {
            Keep::Never => false,
            Keep::Always => true,
            Keep::Every(interval) => at >= kept + interval,
            Keep::OnChange => {
                let same = self.last.get(topic as usize) == Some(&fingerprint(words));
                at >= kept + if same { REMINDER } else { HASTE }
            }
        }
    }

    fn remember(&mut self, topic: wiring::Id, at: Instant, generation: u32, words: &[u32]) {
        let place = topic as usize;
        if wiring::TOPICS.get(place).is_none_or(|info| info.words != words.len()) {
            return;
        }
        if let Some(kept) = self.kept.get_mut(place) {
            // A sample every 40 ms is one every 40 ms, whatever the topic's own rhythm.
            *kept = Some(match (*kept, keep(topic)) {
                (Some(kept), Keep::Every(interval)) if at < kept + interval + interval => kept + interval,
                _ => at,
            });
        }
        if let Some(last) = self.last.get_mut(place) {
            *last = fingerprint(words);
        }
        let length = HEAD + words.len();
        while self.used + length > WORDS {
            let Some(oldest) = self.record(0) else { return };
            let gone = HEAD + oldest.length;
            (self.oldest, self.used) = ((self.oldest + gone) % WORDS, self.used - gone);
        }
        let head = [topic as u32 | generation << 8, at.as_micros() as u32];
        for word in head.iter().chain(words) {
            if let Some(place) = self.memory.get_mut((self.oldest + self.used) % WORDS) {
                *place = *word;
            }
            self.used += 1;
        }
        (self.newest, self.changes) = (at, self.changes.wrapping_add(1));
    }

    /// The record that begins so many words after the oldest.
    fn record(&self, offset: usize) -> Option<Record> {
        if offset >= self.used {
            return None;
        }
        let word = |index: usize| self.memory.get((self.oldest + offset + index) % WORDS).copied().unwrap_or_default();
        let topic = (word(0) & 0xFF) as usize;
        let later = i64::from(word(1).wrapping_sub(self.newest.as_micros() as u32).cast_signed());
        let mut record = Record {
            topic,
            at: Instant::from_micros(self.newest.as_micros().saturating_add_signed(later)),
            generation: word(0) >> 8,
            words: [0; LONGEST],
            length: wiring::TOPICS.get(topic)?.words,
        };
        for (index, place) in record.words.iter_mut().take(record.length).enumerate() {
            *place = word(HEAD + index);
        }
        Some(record)
    }

    /// Where the oldest record is.
    #[must_use]
    pub const fn begin(&self) -> Cursor {
        Cursor { offset: 0, changes: self.changes }
    }

    /// The record at this place, which goes on to the next; `None` behind the newest. For who cannot keep
    /// [`records`](Self::records) borrowed.
    ///
    /// # Errors
    /// When the place means nothing any more.
    pub fn next(&self, cursor: &mut Cursor) -> Result<Option<Record>, Changed> {
        if cursor.changes != self.changes {
            return Err(Changed);
        }
        let record = self.record(cursor.offset);
        cursor.offset += record.map_or(0, |record| HEAD + record.length);
        Ok(record)
    }

    /// What is remembered, oldest first.
    pub fn records(&self) -> impl Iterator<Item = Record> {
        let mut cursor = self.begin();
        core::iter::from_fn(move || self.next(&mut cursor).ok().flatten())
    }
}

fn is_armed(words: &[u32]) -> bool {
    let mut copy = SystemMode::ZERO;
    for (to, from) in copy.as_mut().iter_mut().zip(words) {
        *to = *from;
    }
    SystemMode::from_words(&copy).is_some_and(|mode| mode.armed)
}

/// 32-bit FNV-1a, by words: samples that differ in one word differ in it, others nearly always.
fn fingerprint(words: &[u32]) -> u32 {
    words.iter().fold(0x811C_9DC5, |hash, word| (hash ^ word).wrapping_mul(0x0100_0193))
}

const _: () = assert!(wiring::COUNT <= 0xFF, "a record has eight bits for its topic");

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    const EVENTS: [wiring::Id; 4] =
        [wiring::Id::self_test, wiring::Id::command_guided, wiring::Id::button_event, wiring::Id::estimator_command];

    fn mode(armed: bool) -> impl AsRef<[u32]> {
        SystemMode { armed, ..Default::default() }.to_words()
    }

    fn arm<const WORDS: usize>(black_box: &mut BlackBox<WORDS>, at: Instant) {
        black_box.note(wiring::Id::system_mode, at, 1, mode(true).as_ref());
    }

    proptest! {
        /// What is remembered is the newest, in order and unchanged, and no room is left unused.
        #[test]
        fn the_newest_is_kept(
            start in any::<u32>().prop_map(|start| Instant::from_micros(u64::from(start) << 8)),
            picks in prop::collection::vec((0usize..4, 0u64..1_000, any::<u32>()), 1..200),
        ) {
            let mut black_box = BlackBox::<257>::new();
            arm(&mut black_box, start);
            let mut all = std::vec![(wiring::Id::system_mode as usize, start, 1, mode(true).as_ref().to_vec())];
            let mut at = start;
            for (pick, later, seed) in picks {
                at += Duration::from_micros(later);
                let topic = EVENTS[pick];
                let words: Vec<u32> =
                    (0..wiring::TOPICS[topic as usize].words as u32).map(|index| seed.wrapping_add(index)).collect();
                black_box.note(topic, at, seed, &words);
                all.push((topic as usize, at, seed & 0xFF_FFFF, words));
            }
            let kept: Vec<_> =
                black_box.records().map(|r| (r.topic, r.at, r.generation, r.words().to_vec())).collect();
            prop_assert!(!kept.is_empty());
            prop_assert_eq!(&kept[..], &all[all.len() - kept.len()..]);
            let size: usize = kept.iter().map(|(.., words)| HEAD + words.len()).sum();
            let one_more = all.len() > kept.len();
            prop_assert!(!one_more || size + HEAD + LONGEST > 257, "more would have fitted: {}", size);
        }
    }

    #[test]
    fn a_flight_begins_when_the_vehicle_is_armed_and_ends_a_moment_after() {
        let mut black_box = BlackBox::<256>::new();
        let event = |black_box: &mut BlackBox<256>, at| black_box.note(wiring::Id::self_test, at, 0, &[0, 0]);
        let events = |black_box: &BlackBox<256>| {
            let events = black_box.records().filter(|record| record.topic == wiring::Id::self_test as usize);
            events.map(|record| record.at.as_micros() / 1_000).collect::<Vec<_>>()
        };
        event(&mut black_box, Instant::from_millis(1));
        assert_eq!(black_box.records().count(), 0, "standing about");
        arm(&mut black_box, Instant::from_millis(10));
        event(&mut black_box, Instant::from_millis(11));
        black_box.note(wiring::Id::system_mode, Instant::from_millis(100), 2, mode(false).as_ref());
        event(&mut black_box, Instant::from_millis(259));
        event(&mut black_box, Instant::from_millis(260));
        assert_eq!(events(&black_box), [11, 259]);
        let mut cursor = black_box.begin();
        assert!(black_box.next(&mut cursor).is_ok_and(|record| record.is_some()));
        arm(&mut black_box, Instant::from_millis(500));
        assert_eq!(events(&black_box), [], "the next flight");
        assert_eq!(black_box.next(&mut cursor), Err(Changed));
    }

    #[test]
    fn decisions_are_kept_when_they_change_and_once_a_second() {
        let mut black_box = BlackBox::<1024>::new();
        for millis in 0..3_000u32 {
            let decided = SystemMode { armed: true, transitions: (millis / 1_500) * 2, ..Default::default() };
            black_box.note(
                wiring::Id::system_mode,
                Instant::from_millis(millis.into()),
                millis,
                decided.to_words().as_ref(),
            );
        }
        assert_eq!(black_box.records().map(|r| r.generation).collect::<Vec<_>>(), [0, 1_000, 1_500, 2_500]);
        // One that flickers leaves room for the others.
        for millis in 3_000..4_000u32 {
            let decided = SystemMode { armed: true, transitions: millis, ..Default::default() };
            black_box.note(
                wiring::Id::system_mode,
                Instant::from_millis(millis.into()),
                millis,
                decided.to_words().as_ref(),
            );
        }
        assert_eq!(black_box.records().count(), 4 + 50);
    }
}
