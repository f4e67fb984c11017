//! The black box: the last seconds of a flight, in memory, as many samples as fit.
//!
//! Flash cannot be written in flight, so the vehicle remembers in RAM and tells after landing. Samples are kept as the
//! words the bus moves; when there is no room the oldest go. Of each topic at most one sample an interval is kept, which
//! trades detail for length; the log of a host, which has room, keeps all.
//!
//! [`open`] starts the log file that the remembered samples go into.

use crate::{VehicleConfig, parameters, wiring};
use stampfly_log::ulog::{Definitions, ParameterValue, Sink, Topic, WriteError, Writer};
use stampfly_types::Micros;

/// Words before those of a sample: topic and length, generation, instant.
const HEAD: usize = 4;
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
    pub at: Micros,
    /// The topic's running number of this sample.
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

/// The last seconds of a flight, in `WORDS` words of memory.
///
/// ```
/// use stampfly_board::{black_box::BlackBox, wiring};
/// use stampfly_types::{Message, Micros, messages::TofData};
/// let mut black_box = BlackBox::<64>::new(Micros::from_millis(20));
/// for millis in 0..100 {
///     let range = TofData { distance: 0.001 * millis as f32, valid: true, ..Default::default() };
///     black_box.note(wiring::Id::sensor_tof, Micros::from_millis(millis), millis as u32, &range.to_words());
/// }
/// let kept: Vec<u64> = black_box.records().map(|record| record.at.0 / 1_000).collect();
/// assert_eq!(kept, [0, 20, 40, 60, 80]);
/// ```
#[derive(Clone, Debug)]
pub struct BlackBox<const WORDS: usize> {
    memory: [u32; WORDS],
    /// Where the oldest record begins.
    oldest: usize,
    /// Words in use, from there on and round the end.
    used: usize,
    interval: Micros,
    /// When the next sample of each topic is due.
    due: [Micros; wiring::COUNT],
}

impl<const WORDS: usize> BlackBox<WORDS> {
    /// Nothing remembered. Keeps a sample of each topic per interval.
    #[must_use]
    pub const fn new(interval: Micros) -> Self {
        const { assert!(WORDS > HEAD + LONGEST, "no room for the longest message") }
        Self { memory: [0; WORDS], oldest: 0, used: 0, interval, due: [Micros::ZERO; wiring::COUNT] }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        (self.oldest, self.used, self.due) = (0, 0, [Micros::ZERO; wiring::COUNT]);
    }

    /// Remembers a sample, if one of its topic is due.
    pub fn note(&mut self, topic: wiring::Id, at: Micros, generation: u32, words: &[u32]) {
        let Some(due) = self.due.get_mut(topic as usize) else { return };
        if at < *due || words.len() > LONGEST {
            return;
        }
        *due = at + self.interval;
        let length = HEAD + words.len();
        while self.used + length > WORDS {
            let Some(oldest) = self.record(0) else { return };
            let gone = HEAD + oldest.length;
            (self.oldest, self.used) = ((self.oldest + gone) % WORDS, self.used - gone);
        }
        let head = [topic as u32 | (words.len() as u32) << 16, generation, at.0 as u32, (at.0 >> 32) as u32];
        for word in head.iter().chain(words) {
            if let Some(place) = self.memory.get_mut((self.oldest + self.used) % WORDS) {
                *place = *word;
            }
            self.used += 1;
        }
    }

    /// The record that begins so many words after the oldest.
    fn record(&self, offset: usize) -> Option<Record> {
        if offset >= self.used {
            return None;
        }
        let word = |index: usize| self.memory.get((self.oldest + offset + index) % WORDS).copied().unwrap_or_default();
        let mut record = Record {
            topic: (word(0) & 0xFFFF) as usize,
            at: Micros(u64::from(word(2)) | u64::from(word(3)) << 32),
            generation: word(1),
            words: [0; LONGEST],
            length: (word(0) >> 16) as usize,
        };
        for (index, place) in record.words.iter_mut().take(record.length).enumerate() {
            *place = word(HEAD + index);
        }
        Some(record)
    }

    /// What is remembered, oldest first.
    pub fn records(&self) -> impl Iterator<Item = Record> {
        let mut offset = 0;
        core::iter::from_fn(move || {
            let record = self.record(offset)?;
            offset += HEAD + record.length;
            Some(record)
        })
    }
}

/// Every topic, as the log wants them.
static TOPICS: [Topic; wiring::COUNT] = {
    let mut topics = [Topic { name: "", fields: &[] }; wiring::COUNT];
    let mut index = 0;
    while index < wiring::COUNT {
        topics[index] = Topic { name: wiring::TOPICS[index].name, fields: wiring::TOPICS[index].fields };
        index += 1;
    }
    topics
};

/// Starts a log that explains itself: every topic, every parameter.
///
/// ```
/// use stampfly_board::{VehicleConfig, black_box};
/// use stampfly_log::ulog::Ram;
/// use stampfly_types::Micros;
/// let mut memory = [0; 16_384];
/// let log = black_box::open(Ram::new(&mut memory), Micros(0), &VehicleConfig::default())?;
/// assert!(log.sink().written().starts_with(b"ULog"));
/// # Ok::<(), stampfly_log::ulog::WriteError<stampfly_log::ulog::Full>>(())
/// ```
///
/// # Errors
/// When the sink refuses.
pub fn open<S: Sink>(sink: S, at: Micros, config: &VehicleConfig) -> Result<Writer<'static, S>, WriteError<S::Error>> {
    head(sink, at, config)?.data(&TOPICS, &[])
}

/// The beginning of every log of this vehicle: its name and every parameter, so that a replay flies with them.
///
/// # Errors
/// When the sink refuses.
pub fn head<S: Sink>(sink: S, at: Micros, config: &VehicleConfig) -> Result<Definitions<S>, WriteError<S::Error>> {
    let mut head = Definitions::start(sink, at)?;
    head.info("sys_name", "StampFly")?;
    for parameter in parameters::PARAMETERS {
        head.parameter(parameter.name, ParameterValue::Float(parameter.get(config)))?;
    }
    Ok(head)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use stampfly_log::ulog::{Message, Ram, Reader, Sample};
    use std::vec;
    use std::vec::Vec;

    const TOPIC: [wiring::Id; 3] = [wiring::Id::sensor_tof, wiring::Id::sensor_imu, wiring::Id::estimate_state];

    proptest! {
        /// What is remembered is the newest of what was due, in order and unchanged.
        #[test]
        fn the_newest_is_kept(picks in prop::collection::vec((0usize..3, any::<u32>()), 1..200)) {
            let mut black_box = BlackBox::<257>::new(Micros::ZERO);
            let mut all: Vec<(usize, Micros, u32, Vec<u32>)> = Vec::new();
            for (generation, (pick, seed)) in picks.into_iter().enumerate() {
                let topic = TOPIC[pick];
                let words: Vec<u32> =
                    (0..wiring::TOPICS[topic as usize].words as u32).map(|index| seed.wrapping_add(index)).collect();
                let at = Micros(u64::from(seed) << 20);
                // Time may go back between topics; of one topic it does not.
                let at = all.iter().filter(|(other, ..)| *other == topic as usize).map(|(_, at, ..)| *at).max().max(Some(at));
                let at = at.unwrap_or_default();
                black_box.note(topic, at, generation as u32, &words);
                all.push((topic as usize, at, generation as u32, words));
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
    fn what_is_remembered_makes_a_log() {
        let mut black_box = BlackBox::<4096>::new(Micros::ZERO);
        for index in 0..50u32 {
            let words = vec![0; wiring::TOPICS[wiring::Id::sensor_imu as usize].words];
            black_box.note(wiring::Id::sensor_imu, Micros(u64::from(index) * 2_500), index, &words);
        }
        let mut memory = vec![0; 65_536];
        let mut log = open(Ram::new(&mut memory), Micros(0), &VehicleConfig::default()).expect("room");
        for record in black_box.records() {
            let sample = Sample { at: record.at, generation: record.generation, words: record.words() };
            log.sample(record.topic, &sample).expect("room");
        }
        let read = Reader::new(log.sink().written()).expect("a log");
        let samples = read.filter(|message| matches!(message, Ok(Message::Data { .. }))).count();
        assert_eq!(samples, 50);
        black_box.clear();
        assert_eq!(black_box.records().count(), 0);
    }
}
