//! A flight from a ULog file, ours or anybody's.
//!
//! What cannot be used is left out and listed in [`FlightLog::omissions`], with its place in the
//! file; a log that was cut off by a crash is still worth reading, and [`FlightLog::end`] says how
//! far it is whole. Only a file that is no log at all is an error. Formats within formats are
//! unfolded, as pyulog does: `current.lat`, `esc[0].esc_rpm`.
//!
//! A file may claim what it likes: time and memory are bounded by its size and by the limits on
//! topics, columns and names that [`Omission::Topic`] tells of.

mod meanings;
mod topics;

use crate::flight::{Event, Flight};
use meanings::Meanings;
use stampfly_log::plain;
use stampfly_log::ulog::{End, Message, ParameterValue, ReadError, Reader};
use stampfly_types::Instant;
use std::fmt;
use std::path::{Path, PathBuf};
use topics::Topics;

/// Omissions that are listed one by one.
const LISTED: usize = 100;

/// Why a file could not be loaded.
#[derive(Debug)]
pub struct LogError {
    /// The file.
    pub file: PathBuf,
    /// What is wrong with it.
    pub kind: LogErrorKind,
}

/// What is wrong with a file.
#[derive(Debug)]
#[non_exhaustive]
pub enum LogErrorKind {
    /// It could not be read.
    Io(std::io::Error),
    /// It is not a log we can read; the error holds the byte offset.
    Read(ReadError),
}

impl fmt::Display for LogError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let file = self.file.display();
        match &self.kind {
            LogErrorKind::Io(error) => write!(f, "{file}: {error}"),
            LogErrorKind::Read(error) => write!(f, "{file}: {error}"),
        }
    }
}

impl std::error::Error for LogError {}

/// Something in a log that was left out.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Omission {
    /// A damaged place.
    Damage(ReadError),
    /// A topic whose format is missing or cannot be laid out, or that is one too many.
    Topic {
        /// The topic's name.
        topic: String,
        /// Why.
        reason: String,
    },
    /// Samples shorter than their format.
    ShortSamples {
        /// The topic's name.
        topic: String,
        /// How many.
        count: usize,
    },
    /// Samples of a number no subscription explains.
    UnknownData {
        /// The number.
        id: u16,
        /// How many.
        count: usize,
    },
    /// Behind the hundredth: more of these.
    More {
        /// How many.
        count: usize,
    },
}

impl fmt::Display for Omission {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Damage(error) => error.fmt(f),
            Self::Topic { topic, reason } => write!(f, "topic `{}` left out: {}", plain(topic), plain(reason)),
            Self::ShortSamples { topic, count } => write!(f, "{count} samples of `{}` are too short", plain(topic)),
            Self::UnknownData { id, count } => write!(f, "{count} samples of unknown topic number {id}"),
            Self::More { count } => write!(f, "{count} things more"),
        }
    }
}

/// A flight and what is known about its log.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FlightLog {
    /// The flight.
    pub flight: Flight,
    /// How far the log is whole.
    pub end: End,
    /// Length of each dropout in milliseconds, and the time of the newest sample before it.
    pub dropouts: Vec<(Instant, u16)>,
    /// What was left out.
    pub omissions: Vec<Omission>,
}

/// Loads a log file.
///
/// # Errors
/// When the file cannot be read or is not a log.
pub fn load(path: impl AsRef<Path>) -> Result<FlightLog, LogError> {
    let path = path.as_ref();
    let failed = |kind| LogError { file: path.to_owned(), kind };
    let bytes = std::fs::read(path).map_err(LogErrorKind::Io).map_err(failed)?;
    parse(&bytes).map_err(LogErrorKind::Read).map_err(failed)
}

/// Reads a log from memory.
///
/// ```
/// use stampfly_host::flight_log;
/// use stampfly_log::ulog::{Definitions, Ram, Sample, Topic};
/// use stampfly_types::{Instant, Message, messages::PowerData};
///
/// let mut memory = [0; 4096];
/// let topics = [Topic { name: "sensor_power", fields: PowerData::FIELDS }];
/// let mut log = Definitions::start(Ram::new(&mut memory), Instant::ZERO)?.data(&topics[..])?;
/// let words = PowerData { voltage: 3.5, current: 2.0, power: 7.0 }.to_words();
/// log.sample(0, &Sample { at: Instant::from_micros(10), generation: 1, words: &words })?;
///
/// let flight = flight_log::parse(log.sink().written())?.flight;
/// assert_eq!(flight.topics["sensor_power"].column("voltage"), Some(&[3.5][..]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// When the bytes are not a log.
pub fn parse(bytes: &[u8]) -> Result<FlightLog, ReadError> {
    let mut reader = Reader::new(bytes)?;
    let mut log = FlightLog::default();
    log.flight.started = reader.started();
    let mut topics = Topics::default();
    let mut meanings = Meanings::default();
    let mut omissions = Omissions::default();
    let mut newest = reader.started();

    for message in reader.by_ref() {
        match message {
            Err(error) => omissions.push(Omission::Damage(error)),
            Ok(Message::Format(format)) => topics.format(format),
            Ok(Message::Info { key, value }) => {
                if let Some((name, fact)) = meanings.take(key, value) {
                    log.flight.info.insert(name, fact);
                }
            }
            Ok(Message::Parameter { name, value }) => {
                let value = match value {
                    ParameterValue::Float(value) => f64::from(value),
                    ParameterValue::Int32(value) => f64::from(value),
                };
                log.flight.parameters.entry(name.to_owned()).or_default().push((newest, value));
            }
            Ok(Message::Subscription { id, instance, topic }) => {
                if let Err(reason) = topics.subscribe(&mut log.flight, id, instance, topic) {
                    omissions.push(Omission::Topic { topic: topic.to_owned(), reason });
                }
            }
            Ok(Message::Data { id, payload }) => {
                if let Some(at) = topics.sample(&mut log.flight, id, payload) {
                    newest = newest.max(at);
                }
            }
            Ok(Message::Text { at, text, .. }) => log.flight.events.push(Event { at, text: text.to_owned() }),
            Ok(Message::Dropout { duration }) => log.dropouts.push((newest, duration)),
            Ok(_) => {}
        }
    }

    meanings.file(&mut log.flight);
    topics.omissions().for_each(|omission| omissions.push(omission));
    log.omissions = omissions.listed();
    log.end = reader.end();
    Ok(log)
}

/// The first ones, and how many more there are: a file can have one in every message.
#[derive(Default)]
struct Omissions {
    listed: Vec<Omission>,
    more: usize,
}

impl Omissions {
    fn push(&mut self, omission: Omission) {
        if self.listed.len() < LISTED {
            self.listed.push(omission);
        } else {
            self.more += 1;
        }
    }

    fn listed(mut self) -> Vec<Omission> {
        self.listed.extend((self.more > 0).then_some(Omission::More { count: self.more }));
        self.listed
    }
}
