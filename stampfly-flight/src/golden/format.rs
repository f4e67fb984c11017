//! The bytes of a golden flight: a header, then one entry after the other.
//!
//! | entry | first byte | then |
//! |---|---|---|
//! | sample from outside | its topic's place in the topic table | instant, words |
//! | turn of the executor | `0xf0` | clock |
//! | newest sample of the output topic | `0xf1` | words |
//!
//! An instant is the signed difference in µs to the clock of the turn before, zigzag and seven bits a byte, so that
//! small ones of either sign are short. Words are little-endian.
//!
//! | header | bytes | what |
//! |---|---|---|
//! | magic | 4 | `SFG2` |
//! | length | 4 | of everything, header included |
//! | tables | 8 | [`tables`] of the vehicle that recorded it |
//! | start | 8 | the clock at power-on, µs |
//! | hash | 8 | over everything published |
//! | output | 8 | the output topic's place in the topic table |

use super::error::GoldenError;
use crate::newest::{MAX_MESSAGE, longest_message};
use heapless::Vec;
use stampfly_bus::{Schedule, TopicInfo, TopicTable};
use stampfly_log::FlightHash;
use stampfly_types::Instant;

const MAGIC: [u8; 4] = *b"SFG2";
const HEADER: usize = 40;
const TURN: u8 = 0xf0;
const OUTPUT: u8 = 0xf1;

/// One number for the tables a golden flight depends on: topics with their sizes, and runnables.
#[must_use]
pub fn tables<R: Schedule>() -> u64 {
    const {
        let topics = <R::Topics as TopicTable>::TOPICS;
        assert!(topics.len() < TURN as usize, "a topic's place is one byte below those of the other entries");
        assert!(longest_message(topics) <= MAX_MESSAGE, "a message is too long");
    }
    let mut hash = FlightHash::new();
    let topics = <R::Topics as TopicTable>::TOPICS.iter().map(|topic| (topic.name, topic.words));
    let activations = R::ACTIVATIONS.iter().map(|activation| (activation.name, 0));
    for (place, (name, size)) in topics.chain(activations).enumerate() {
        for letter in name.bytes() {
            hash.publish(place as u16, size as u32, Instant::ZERO, &[u32::from(letter)]);
        }
    }
    hash.finish()
}

/// What is known before the first entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) start: Instant,
    pub(super) hash: u64,
    pub(super) output: usize,
}

/// One entry.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Entry {
    /// A participant outside published.
    Sample { topic: usize, at: Instant, words: Vec<u32, MAX_MESSAGE> },
    /// The executor runs what is due at this instant.
    Turn(Instant),
    /// The newest sample of the output topic.
    Output(Vec<u32, MAX_MESSAGE>),
}

/// The entries of a golden flight, in order.
pub(super) struct Reader<'a> {
    rest: &'a [u8],
    clock: Instant,
    topics: &'static [TopicInfo],
    output: usize,
}

/// Reads the header.
pub(super) fn open<R: Schedule>(record: &[u8]) -> Result<(Header, Reader<'_>), GoldenError> {
    let topics = <R::Topics as TopicTable>::TOPICS;
    let mut reader = Reader { rest: record, clock: Instant::ZERO, topics, output: 0 };
    if reader.array() != Some(MAGIC) {
        return Err(GoldenError::NotGolden);
    }
    let length = reader.array().map(u32::from_le_bytes);
    let numbers = [(); 4].map(|()| reader.array().map(u64::from_le_bytes));
    let [Some(recorded), Some(start), Some(hash), Some(output)] = numbers else { return Err(GoldenError::Damaged) };
    if length.is_none_or(|length| length as usize != record.len()) {
        return Err(GoldenError::Damaged);
    }
    if recorded != tables::<R>() {
        return Err(GoldenError::OtherTables);
    }
    let output = usize::try_from(output).ok().filter(|output| *output < topics.len()).ok_or(GoldenError::Damaged)?;
    let start = Instant::from_micros(start);
    (reader.clock, reader.output) = (start, output);
    Ok((Header { start, hash, output }, reader))
}

impl Reader<'_> {
    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.rest.split_first_chunk()?;
        self.rest = rest;
        Some(*head)
    }

    fn instant(&mut self) -> Option<Instant> {
        let mut folded = 0;
        for shift in (0..u64::BITS).step_by(7) {
            let [byte] = self.array()?;
            folded |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                break;
            }
        }
        let difference = (folded >> 1).cast_signed() ^ -(folded & 1).cast_signed();
        Some(Instant::from_micros(self.clock.as_micros().wrapping_add_signed(difference)))
    }

    fn words(&mut self, topic: usize) -> Option<Vec<u32, MAX_MESSAGE>> {
        let mut words = Vec::new();
        for _ in 0..self.topics.get(topic)?.words {
            words.push(u32::from_le_bytes(self.array()?)).ok()?;
        }
        Some(words)
    }

    fn entry(&mut self, kind: u8) -> Option<Entry> {
        Some(match kind {
            TURN => {
                self.clock = self.instant()?;
                Entry::Turn(self.clock)
            }
            OUTPUT => Entry::Output(self.words(self.output)?),
            topic => {
                let topic = usize::from(topic);
                Entry::Sample { topic, at: self.instant()?, words: self.words(topic)? }
            }
        })
    }
}

impl Iterator for Reader<'_> {
    type Item = Result<Entry, GoldenError>;

    fn next(&mut self) -> Option<Self::Item> {
        let [kind] = self.array()?;
        Some(self.entry(kind).ok_or(GoldenError::Damaged))
    }
}

/// Writes the entries of a golden flight, in the order in which things happened. See [`play`](super::play) for an example.
pub struct Writer<F: FnMut(&[u8])> {
    out: F,
    tables: u64,
    start: Instant,
    output: usize,
    clock: Instant,
    length: usize,
}

impl<F: FnMut(&[u8])> Writer<F> {
    /// A flight of a vehicle with these [`tables`], switched on at `start`. `output` is the place of the topic by which it
    /// is judged. `out` gets the entries in pieces; the [`header`](Self::header) that goes before them is made last.
    pub fn new(tables: u64, start: Instant, output: usize, out: F) -> Self {
        Self { out, tables, start, output, clock: start, length: HEADER }
    }

    /// Ends the record: the header of these entries, which publish messages with this hash.
    #[must_use]
    pub fn header(self, hash: u64) -> [u8; HEADER] {
        let mut header = [0; HEADER];
        // Magic and length share the first eight bytes.
        let first = u64::from(u32::from_le_bytes(MAGIC)) | (self.length as u64) << 32;
        let values = [first, self.tables, self.start.as_micros(), hash, self.output as u64];
        for (place, value) in header.as_chunks_mut().0.iter_mut().zip(values) {
            *place = value.to_le_bytes();
        }
        header
    }

    fn put(&mut self, bytes: &[u8]) {
        self.length += bytes.len();
        (self.out)(bytes);
    }

    fn words(&mut self, words: &[u32]) {
        words.iter().for_each(|word| self.put(&word.to_le_bytes()));
    }

    fn instant(&mut self, at: Instant) {
        let difference = at.as_micros().wrapping_sub(self.clock.as_micros()).cast_signed();
        let mut folded = (difference << 1 ^ difference >> 63).cast_unsigned();
        while folded >= 0x80 {
            self.put(&[folded as u8 | 0x80]);
            folded >>= 7;
        }
        self.put(&[folded as u8]);
    }

    /// A participant outside published on the topic at this place in the table.
    pub fn sample(&mut self, topic: usize, at: Instant, words: &[u32]) {
        self.put(&[topic as u8]);
        self.instant(at);
        self.words(words);
    }

    /// The executor ran what was due at this instant.
    pub fn turn(&mut self, clock: Instant) {
        self.put(&[TURN]);
        self.instant(clock);
        self.clock = clock;
    }

    /// The newest sample of the output topic, after a turn.
    pub fn output(&mut self, words: &[u32]) {
        self.put(&[OUTPUT]);
        self.words(words);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rover::{Rover, topics};
    use proptest::prelude::*;

    const MOTORS: usize = topics::Id::actuator_motor as usize;

    /// Entries as they can follow each other, at instants before and after the clock.
    fn entries() -> impl Strategy<Value = std::vec::Vec<Entry>> {
        let words = |topic: usize, seed: u32| {
            (0..topics::TOPICS[topic].words as u32).map(|word| seed.wrapping_mul(word + 1)).collect()
        };
        let instant = || any::<u32>().prop_map(|at| Instant::from_micros(u64::from(at)));
        let sample = (0..topics::COUNT, instant(), any::<u32>()).prop_map(move |(topic, at, seed)| Entry::Sample {
            topic,
            at,
            words: words(topic, seed),
        });
        let output = any::<u32>().prop_map(move |seed| Entry::Output(words(MOTORS, seed)));
        prop::collection::vec(prop_oneof![sample, instant().prop_map(Entry::Turn), output], 0..40)
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(entries in entries(), start: u32, hash: u64) {
            let start = Instant::from_micros(u64::from(start));
            let mut bytes = std::vec::Vec::new();
            let out = |piece: &[u8]| bytes.extend_from_slice(piece);
            let mut writer = Writer::new(tables::<Rover>(), start, MOTORS, out);
            for entry in &entries {
                match entry {
                    Entry::Sample { topic, at, words } => writer.sample(*topic, *at, words),
                    Entry::Turn(clock) => writer.turn(*clock),
                    Entry::Output(words) => writer.output(words),
                }
            }
            let mut record = std::vec::Vec::from(writer.header(hash));
            record.append(&mut bytes);
            let (header, reader) = open::<Rover>(&record).expect("a record");
            prop_assert_eq!(header, Header { start, hash, output: MOTORS });
            prop_assert_eq!(reader.collect::<Result<std::vec::Vec<_>, _>>(), Ok(entries));
        }
    }
}
