//! What frames say: questions of the computer, answers of the vehicle, and the samples and activations in them.
//!
//! | question | kind | payload | answer |
//! |---|---|---|---|
//! | [`Hello`](Request::Hello) | 1 | version (2 bytes), [`tables`](crate::golden::tables) (8) | `Taken`, or why not |
//! | [`Parameter`](Request::Parameter) | 2 | value (4), name | `Taken`, or why not |
//! | [`Start`](Request::Start) | 3 | clock at power-on, µs (8) | `Taken` |
//! | [`Step`](Request::Step) | 4 | clock, µs (8), bands (1), samples | `Stepped` |
//! | [`End`](Request::End) | 5 | | `Taken` |
//!
//! | answer | kind | payload |
//! |---|---|---|
//! | [`Taken`](Reply::Taken) | 0x81 | |
//! | [`Stepped`](Reply::Stepped) | 0x82 | next tick, µs (8), bands (1), time taken, µs (4), garbled (4), lost (4), samples and activations |
//! | [`Refused`](Reply::Refused) | 0x83 | why (1) |
//!
//! | entry | first byte | then |
//! |---|---|---|
//! | sample | its topic's place in the topic table | instant, µs (8), words |
//! | activation | 0xf0 | line of the activation table (1), instant (8), refused publishes (4), inputs (1), of each generation (4) and taken (2) |

use super::frame::{Encoder, Fields};
use crate::newest::MAX_MESSAGE;
use core::fmt;
use heapless::Vec;
use stampfly_bus::TopicInfo;
use stampfly_types::{ActivationRecord, Duration, InputRecord, Instant};

/// Version of what is said here. Both ends must have the same.
pub const VERSION: u16 = 1;

const HELLO: u8 = 1;
const PARAMETER: u8 = 2;
const START: u8 = 3;
const STEP: u8 = 4;
const END: u8 = 5;
const TAKEN: u8 = 0x81;
const STEPPED: u8 = 0x82;
const REFUSED: u8 = 0x83;
const ACTIVATION: u8 = 0xf0;
/// No tick is to come.
const NEVER: u64 = u64::MAX;

/// Why the vehicle does not do what it is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Refusal {
    /// It speaks another version.
    OtherVersion,
    /// It has other topics or runnables.
    OtherTables,
    /// It has no such parameter.
    UnknownParameter,
    /// The parameter does not take this value.
    OutOfRange,
    /// A payload that is none of its kind, a sample of a topic that nobody outside publishes, or a step that leads back or ten
    /// seconds ahead.
    Nonsense,
    /// Not at this point of the conversation, or a frame between was never seen.
    OutOfOrder,
    /// Its answer is longer than its memory for one.
    NoRoom,
    /// It was left alone for too long, and has ended the flight.
    Silence,
}

impl Refusal {
    const ALL: [Self; 8] = [
        Self::OtherVersion,
        Self::OtherTables,
        Self::UnknownParameter,
        Self::OutOfRange,
        Self::Nonsense,
        Self::OutOfOrder,
        Self::NoRoom,
        Self::Silence,
    ];
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::OtherVersion => "the vehicle speaks another version of this protocol",
            Self::OtherTables => "the vehicle has other topics or runnables",
            Self::UnknownParameter => "the vehicle has no such parameter",
            Self::OutOfRange => "the vehicle does not take this value",
            Self::Nonsense => "the vehicle does not understand",
            Self::OutOfOrder => "the vehicle did not expect this now",
            Self::NoRoom => "the vehicle's answer does not fit into its memory",
            Self::Silence => "the vehicle was left alone for too long and has ended the flight",
        })
    }
}

impl core::error::Error for Refusal {}

/// Bands of the activation table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Bands {
    /// The [flight band](stampfly_bus::Band::Flight).
    pub flight: bool,
    /// The [background](stampfly_bus::Band::Background).
    pub background: bool,
}

impl Bands {
    fn byte(self) -> u8 {
        u8::from(self.flight) | u8::from(self.background) << 1
    }

    fn of(byte: u8) -> Option<Self> {
        (byte < 4).then_some(Self { flight: byte & 1 != 0, background: byte & 2 != 0 })
    }
}

/// What the computer asks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Request<'f> {
    /// Opens the conversation.
    Hello {
        /// [`VERSION`] of the computer.
        version: u16,
        /// [`tables`](crate::golden::tables) of the vehicle that it means.
        tables: u64,
    },
    /// Changes a parameter of the vehicle that will fly.
    Parameter {
        /// Its name.
        name: &'f str,
        /// Its value.
        value: f32,
    },
    /// Switches the vehicle on.
    Start(Instant),
    /// Publishes samples, and runs what is due.
    Step {
        /// What the vehicle's clock shows.
        now: Instant,
        /// The bands that may run; with none, samples are published and nothing more.
        bands: Bands,
        /// Samples from outside, oldest first.
        samples: Entries<'f>,
    },
    /// The flight is over.
    End,
}

impl<'f> Request<'f> {
    /// Reads a question. `topics` is the vehicle's table.
    #[must_use]
    pub fn read(kind: u8, payload: &'f [u8], topics: &'static [TopicInfo]) -> Option<Self> {
        let mut fields = Fields(payload);
        let request = match kind {
            HELLO => Self::Hello { version: fields.array().map(u16::from_le_bytes)?, tables: fields.long()? },
            PARAMETER => {
                let value = f32::from_bits(fields.word()?);
                Self::Parameter { value, name: core::str::from_utf8(fields.rest()).ok()? }
            }
            START => Self::Start(fields.instant()?),
            STEP => {
                let (now, bands) = (fields.instant()?, Bands::of(fields.byte()?)?);
                Self::Step { now, bands, samples: Entries { rest: fields.rest(), topics } }
            }
            END => Self::End,
            _ => return None,
        };
        fields.0.is_empty().then_some(request)
    }

    /// Writes it into `out` as a frame and returns its length; `None` when there is no room.
    #[must_use]
    pub fn write(&self, out: &mut [u8], sequence: u16) -> Option<usize> {
        let kind = match self {
            Self::Hello { .. } => HELLO,
            Self::Parameter { .. } => PARAMETER,
            Self::Start(_) => START,
            Self::Step { .. } => STEP,
            Self::End => END,
        };
        let mut frame = Encoder::new(out, sequence, kind);
        match self {
            Self::Hello { version, tables } => {
                frame.put(&version.to_le_bytes());
                frame.put(&tables.to_le_bytes());
            }
            Self::Parameter { name, value } => {
                frame.words(&[value.to_bits()]);
                frame.put(name.as_bytes());
            }
            Self::Start(at) => frame.instant(*at),
            Self::Step { now, bands, samples } => {
                frame.instant(*now);
                frame.put(&[bands.byte()]);
                frame.put(samples.rest);
            }
            Self::End => {}
        }
        frame.finish()
    }
}

/// What the vehicle says of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stepped<'f> {
    /// When a period or a deadline makes something due next, at or before the present clock included.
    pub next_tick: Option<Instant>,
    /// Bands in which something is due that has not run.
    pub due: Bands,
    /// What the step took by the vehicle's own clock.
    pub took: Duration,
    /// Frames that came to the vehicle garbled so far.
    pub garbled: u32,
    /// Samples that its log has missed so far.
    pub lost: u32,
    /// Activations, each followed by what it published.
    pub entries: Entries<'f>,
}

/// What the vehicle answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reply<'f> {
    /// Done.
    Taken,
    /// The step is over.
    Stepped(Stepped<'f>),
    /// Not done.
    Refused(Refusal),
}

impl<'f> Reply<'f> {
    /// Reads an answer. `topics` is the vehicle's table.
    #[must_use]
    pub fn read(kind: u8, payload: &'f [u8], topics: &'static [TopicInfo]) -> Option<Self> {
        let mut fields = Fields(payload);
        let reply = match kind {
            TAKEN => Self::Taken,
            STEPPED => {
                let next_tick = Some(fields.long()?).filter(|tick| *tick != NEVER).map(Instant::from_micros);
                let due = Bands::of(fields.byte()?)?;
                let took = Duration::from_micros(fields.word()?.into());
                let (garbled, lost) = (fields.word()?, fields.word()?);
                let entries = Entries { rest: fields.rest(), topics };
                Self::Stepped(Stepped { next_tick, due, took, garbled, lost, entries })
            }
            REFUSED => {
                let reason = usize::from(fields.byte()?);
                Self::Refused(*Refusal::ALL.get(reason)?)
            }
            _ => return None,
        };
        fields.0.is_empty().then_some(reply)
    }

    /// Writes it into `out` as a frame and returns its length; `None` when there is no room.
    #[must_use]
    pub fn write(&self, out: &mut [u8], sequence: u16) -> Option<usize> {
        let mut frame = Encoder::new(
            out,
            sequence,
            match self {
                Self::Taken => TAKEN,
                Self::Stepped(_) => STEPPED,
                Self::Refused(_) => REFUSED,
            },
        );
        match self {
            Self::Taken => {}
            Self::Stepped(Stepped { next_tick, due, took, garbled, lost, entries }) => {
                frame.put(&next_tick.map_or(NEVER, Instant::as_micros).to_le_bytes());
                frame.put(&[due.byte()]);
                frame.words(&[u32::try_from(took.as_micros()).unwrap_or(u32::MAX), *garbled, *lost]);
                frame.put(entries.rest);
            }
            Self::Refused(why) => frame.put(&[*why as u8]),
        }
        frame.finish()
    }
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
pub enum Entry {
    /// A sample was published.
    Sample {
        /// Its topic's place in the topic table.
        topic: usize,
        /// Its instant.
        at: Instant,
        /// Its message.
        words: Vec<u32, MAX_MESSAGE>,
    },
    /// A runnable ran.
    Activation(ActivationRecord),
}

/// What happened, in order, as bytes. An iterator; `Err` where the bytes are no entry, and nothing after that.
#[derive(Clone, Copy, Debug)]
pub struct Entries<'f> {
    rest: &'f [u8],
    topics: &'static [TopicInfo],
}

impl PartialEq for Entries<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.rest == other.rest
    }
}

impl<'f> Entries<'f> {
    /// The entries that a [`Log`] holds, of the vehicle with this topic table.
    #[must_use]
    pub const fn new(bytes: &'f [u8], topics: &'static [TopicInfo]) -> Self {
        Self { rest: bytes, topics }
    }

    fn entry(&mut self) -> Option<Entry> {
        let mut fields = Fields(self.rest);
        let entry = match fields.byte()? {
            ACTIVATION => {
                let mut record = ActivationRecord::new(fields.byte()?, fields.instant()?);
                record.refused = fields.word()?;
                for _ in 0..fields.byte()? {
                    let (generation, taken) = (fields.word()?, fields.array().map(u16::from_le_bytes)?);
                    record.push(InputRecord { generation, taken }).ok()?;
                }
                Entry::Activation(record)
            }
            topic => {
                let (topic, at) = (usize::from(topic), fields.instant()?);
                let mut words = Vec::new();
                for _ in 0..self.topics.get(topic)?.words {
                    words.push(fields.word()?).ok()?;
                }
                Entry::Sample { topic, at, words }
            }
        };
        self.rest = fields.0;
        Some(entry)
    }
}

/// These bytes are no entry of this vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoEntry;

impl Iterator for Entries<'_> {
    type Item = Result<Entry, NoEntry>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let entry = self.entry();
        if entry.is_none() {
            self.rest = &[];
        }
        Some(entry.ok_or(NoEntry))
    }
}

/// Collects [`Entries`] as bytes in memory that is lent.
#[derive(Debug)]
pub struct Log<'m> {
    memory: &'m mut [u8],
    used: usize,
    is_cut: bool,
}

impl<'m> Log<'m> {
    /// Nothing has happened.
    pub const fn new(memory: &'m mut [u8]) -> Self {
        Self { memory, used: 0, is_cut: false }
    }

    /// Forgets everything.
    pub const fn clear(&mut self) {
        (self.used, self.is_cut) = (0, false);
    }

    /// The bytes; `None` when something did not fit.
    #[must_use]
    pub fn bytes(&self) -> Option<&[u8]> {
        self.memory.get(..self.used).filter(|_| !self.is_cut)
    }

    /// How many bytes there are.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.used
    }

    /// Has nothing happened?
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.used == 0
    }

    fn put(&mut self, bytes: &[u8]) {
        match self.memory.get_mut(self.used..).and_then(|rest| rest.get_mut(..bytes.len())) {
            Some(place) => {
                place.copy_from_slice(bytes);
                self.used += bytes.len();
            }
            None => self.is_cut = true,
        }
    }

    /// A sample was published on the topic at this place in the table.
    pub fn sample(&mut self, topic: usize, at: Instant, words: &[u32]) {
        self.put(&[topic as u8]);
        self.put(&at.as_micros().to_le_bytes());
        words.iter().for_each(|word| self.put(&word.to_le_bytes()));
    }

    /// A runnable ran.
    pub fn activation(&mut self, record: &ActivationRecord) {
        self.put(&[ACTIVATION, record.index]);
        self.put(&record.now.as_micros().to_le_bytes());
        self.put(&record.refused.to_le_bytes());
        self.put(&[record.inputs().len() as u8]);
        for InputRecord { generation, taken } in record.inputs() {
            self.put(&generation.to_le_bytes());
            self.put(&taken.to_le_bytes());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hil::Decoder;
    use crate::rover::topics::{Id, TOPICS};

    const AT: Instant = Instant::from_micros(0x0123_4567_89ab);

    fn log(memory: &mut [u8]) -> Log<'_> {
        let mut log = Log::new(memory);
        let mut record = ActivationRecord::new(1, AT);
        record.refused = 5;
        record.push(InputRecord { generation: 70_000, taken: 3 }).expect("room");
        log.activation(&record);
        log.sample(Id::actuator_motor as usize, AT, &[7; 16][..TOPICS[Id::actuator_motor as usize].words]);
        log
    }

    #[test]
    fn entries_are_read_as_they_were_written() {
        let mut memory = [0; 256];
        let log = log(&mut memory);
        let bytes = log.bytes().expect("room");
        let entries: std::vec::Vec<_> = Entries::new(bytes, &TOPICS).collect();
        assert!(matches!(&entries[..], [Ok(Entry::Activation(record)), Ok(Entry::Sample { topic, at: AT, words })]
            if (record.index, record.refused, record.inputs()[0].generation) == (1, 5, 70_000)
                && *topic == Id::actuator_motor as usize && words.iter().all(|word| *word == 7)));
        for cut in 1..bytes.len() {
            let whole = Entries::new(&bytes[..cut], &TOPICS).filter(Result::is_ok).count();
            assert!(whole < 2, "{cut}");
        }
        assert_eq!(Entries::new(&[0xef], &TOPICS).next(), Some(Err(NoEntry)));
        assert_eq!(Log::new(&mut [0; 8]).bytes(), Some(&[][..]));
        let mut short = [0; 40];
        assert_eq!(self::log(&mut short).bytes(), None);
    }

    #[test]
    fn questions_and_answers_are_read_as_they_were_written() {
        let mut memory = [0; 256];
        let log = log(&mut memory);
        let entries = Entries::new(log.bytes().expect("room"), &TOPICS);
        let bands = Bands { flight: true, background: false };
        let requests = [
            Request::Hello { version: VERSION, tables: 0x1234 },
            Request::Parameter { name: "drive.gain", value: 0.25 },
            Request::Start(AT),
            Request::Step { now: AT, bands, samples: entries },
            Request::End,
        ];
        let stepped = |next_tick| {
            let took = Duration::from_micros(812);
            Reply::Stepped(Stepped { next_tick, due: bands, took, garbled: 3, lost: 4, entries })
        };
        let replies = [Reply::Taken, stepped(Some(AT)), stepped(None)];
        let refusals = Refusal::ALL.map(Reply::Refused);
        let mut wire = [0; 512];
        for request in requests {
            let length = request.write(&mut wire, 9).expect("room");
            let mut decoder = Decoder::new([0; 512]);
            let read = wire[..length].iter().find_map(|byte| {
                decoder.feed(*byte).map(|body| Request::read(body.kind, body.payload, &TOPICS) == Some(request))
            });
            assert_eq!(read, Some(true), "{request:?}");
        }
        for reply in replies.into_iter().chain(refusals) {
            let length = reply.write(&mut wire, 9).expect("room");
            let mut decoder = Decoder::new([0; 512]);
            let read = wire[..length].iter().find_map(|byte| {
                decoder.feed(*byte).map(|body| Reply::read(body.kind, body.payload, &TOPICS) == Some(reply))
            });
            assert_eq!(read, Some(true), "{reply:?}");
        }
    }

    #[test]
    fn payloads_of_another_length_are_none() {
        for (kind, length) in [(HELLO, 9), (HELLO, 11), (START, 7), (STEP, 8), (END, 1), (0, 0), (TAKEN, 0)] {
            assert_eq!(Request::read(kind, &[0; 16][..length], &TOPICS), None, "{kind} {length}");
        }
        assert_eq!(Request::read(PARAMETER, &[0, 0, 0, 0, 0xff], &TOPICS), None, "no UTF-8");
        for (kind, length) in [(TAKEN, 1), (STEPPED, 20), (REFUSED, 0), (REFUSED, 2), (HELLO, 10)] {
            assert_eq!(Reply::read(kind, &[0; 32][..length], &TOPICS), None, "{kind} {length}");
        }
        assert_eq!(Reply::read(REFUSED, &[Refusal::ALL.len() as u8], &TOPICS), None);
    }
}
