//! The bytes of a golden flight: a header, then one entry after the other.
//!
//! | entry | first byte | then |
//! |---|---|---|
//! | sample from outside | its topic's place in the topic table | instant, words |
//! | turn of the executor | `0xf0` | clock |
//! | duty of the motors | `0xf1` | one `f32` a motor |
//!
//! An instant is the signed difference in µs to the clock of the turn before, zigzag and seven bits a byte, so that
//! small ones of either sign take little. Words are little-endian.
//!
//! | header | bytes | what |
//! |---|---|---|
//! | magic | 4 | `SFG1` |
//! | length | 4 | of everything, header included |
//! | tables | 8 | [`tables`] of the program that recorded it |
//! | start | 8 | the clock when the vehicle was switched on, µs |
//! | hash | 8 | over everything published |

use super::GoldenError;
use crate::{plan, wiring};
use heapless::Vec;
use stampfly_log::FlightHash;
use stampfly_types::Instant;

/// Motors whose duty is recorded.
pub const MOTORS: usize = 4;

const MAGIC: [u8; 4] = *b"SFG1";
const HEADER: usize = 32;
const TURN: u8 = 0xf0;
const DUTY: u8 = 0xf1;

/// Words of the largest message.
const MAX_WORDS: usize = {
    let (mut index, mut most) = (0, 0);
    while index < wiring::COUNT {
        if wiring::TOPICS[index].words > most {
            most = wiring::TOPICS[index].words;
        }
        index += 1;
    }
    assert!(wiring::COUNT < TURN as usize, "a topic's place is one byte below those of the other entries");
    most
};

/// One number for the tables a golden flight depends on: topics with their sizes, and runnables.
#[must_use]
pub fn tables() -> u64 {
    let mut hash = FlightHash::new();
    let topics = wiring::TOPICS.iter().map(|topic| (topic.name, topic.words));
    let activations = plan::ACTIVATIONS.iter().map(|activation| (activation.name, 0));
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
}

/// One entry.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Entry {
    /// Somebody outside published.
    Sample { topic: usize, at: Instant, words: Vec<u32, MAX_WORDS> },
    /// The executor looks what is due at this instant.
    Turn(Instant),
    /// What the motors have just been told.
    Duty([f32; MOTORS]),
}

/// The entries of a golden flight, in order.
pub(super) struct Reader<'a> {
    rest: &'a [u8],
    clock: Instant,
}

/// Reads the header.
pub(super) fn open(record: &[u8]) -> Result<(Header, Reader<'_>), GoldenError> {
    let mut reader = Reader { rest: record, clock: Instant::ZERO };
    if reader.array() != Some(MAGIC) {
        return Err(GoldenError::NotGolden);
    }
    let length = reader.array().map(u32::from_le_bytes);
    let [recorded, start, hash] = [(); 3].map(|()| reader.array().map(u64::from_le_bytes));
    let (Some(recorded), Some(start), Some(hash)) = (recorded, start, hash) else { return Err(GoldenError::Damaged) };
    if length.is_none_or(|length| length as usize != record.len()) {
        return Err(GoldenError::Damaged);
    }
    if recorded != tables() {
        return Err(GoldenError::OtherTables);
    }
    reader.clock = Instant::from_micros(start);
    Ok((Header { start: Instant::from_micros(start), hash }, reader))
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

    fn entry(&mut self, kind: u8) -> Option<Entry> {
        Some(match kind {
            TURN => {
                self.clock = self.instant()?;
                Entry::Turn(self.clock)
            }
            DUTY => {
                let mut duty = [0.0; MOTORS];
                for value in &mut duty {
                    *value = f32::from_le_bytes(self.array()?);
                }
                Entry::Duty(duty)
            }
            topic => {
                let topic = usize::from(topic);
                let at = self.instant()?;
                let mut words = Vec::new();
                for _ in 0..wiring::TOPICS.get(topic)?.words {
                    words.push(u32::from_le_bytes(self.array()?)).ok()?;
                }
                Entry::Sample { topic, at, words }
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

/// Makes the entries of a golden flight, in the order in which things happened. For the program that records one.
///
/// `out` gets the pieces; the [`header`](Self::header) that goes in front of them is made last.
pub struct Writer<F: FnMut(&[u8])> {
    out: F,
    start: Instant,
    clock: Instant,
    length: usize,
}

impl<F: FnMut(&[u8])> Writer<F> {
    /// A flight that is switched on at `start`.
    pub fn new(start: Instant, out: F) -> Self {
        Self { out, start, clock: start, length: HEADER }
    }

    /// Ends the record: the header of these entries, which publish messages with this hash.
    #[must_use]
    pub fn header(self, hash: u64) -> [u8; HEADER] {
        let mut header = [0; HEADER];
        // Magic and length share the first eight bytes.
        let first = u64::from(u32::from_le_bytes(MAGIC)) | (self.length as u64) << 32;
        for (place, value) in header.chunks_mut(8).zip([first, tables(), self.start.as_micros(), hash]) {
            place.copy_from_slice(&value.to_le_bytes());
        }
        header
    }

    fn put(&mut self, bytes: &[u8]) {
        self.length += bytes.len();
        (self.out)(bytes);
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

    /// Somebody outside published on the topic with this place in the table.
    pub fn sample(&mut self, topic: u8, at: Instant, words: &[u32]) {
        self.put(&[topic]);
        self.instant(at);
        for word in words {
            self.put(&word.to_le_bytes());
        }
    }

    /// The executor looked what was due, and ran it.
    pub fn turn(&mut self, clock: Instant) {
        self.put(&[TURN]);
        self.instant(clock);
        self.clock = clock;
    }

    /// What the motors were told last.
    pub fn duty(&mut self, duty: &[f32; MOTORS]) {
        self.put(&[DUTY]);
        for value in duty {
            self.put(&value.to_le_bytes());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Entries as they can follow each other, at instants before and after the clock.
    fn entries() -> impl Strategy<Value = std::vec::Vec<Entry>> {
        let sample = (0..wiring::COUNT, any::<u32>(), any::<u32>()).prop_map(|(topic, at, seed)| Entry::Sample {
            topic,
            at: Instant::from_micros(u64::from(at)),
            words: (0..wiring::TOPICS[topic].words as u32).map(|word| seed.wrapping_mul(word + 1)).collect(),
        });
        let turn = any::<u32>().prop_map(|at| Entry::Turn(Instant::from_micros(u64::from(at))));
        let duty = any::<[u16; MOTORS]>().prop_map(|duty| Entry::Duty(duty.map(f32::from)));
        prop::collection::vec(prop_oneof![sample, turn, duty], 0..40)
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(entries in entries(), start in any::<u32>(), hash: u64) {
            let start = Instant::from_micros(u64::from(start));
            let mut bytes = std::vec::Vec::new();
            let mut writer = Writer::new(start, |piece: &[u8]| bytes.extend_from_slice(piece));
            for entry in &entries {
                match entry {
                    Entry::Sample { topic, at, words } => writer.sample(*topic as u8, *at, words),
                    Entry::Turn(clock) => writer.turn(*clock),
                    Entry::Duty(duty) => writer.duty(duty),
                }
            }
            let mut record = std::vec::Vec::from(writer.header(hash));
            record.append(&mut bytes);
            let (header, reader) = open(&record).expect("a record");
            prop_assert_eq!(header, Header { start, hash });
            prop_assert_eq!(reader.collect::<Result<std::vec::Vec<_>, _>>(), Ok(entries));
        }
    }
}
