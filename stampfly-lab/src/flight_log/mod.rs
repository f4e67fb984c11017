//! A flight from a ULog file, ours or anybody's.
//!
//! What cannot be used is left out and listed in [`FlightLog::omissions`], with its place in the file; a log that
//! was cut off by a crash is still worth reading. Only a file that is no log at all is an error.

use crate::flight::{Column, Event, Flight, Meaning};
use stampfly_log::ulog::{self, Format, Message, NAMES_PREFIX, ParameterValue, ReadError, Reader, UNITS_PREFIX};
use stampfly_types::Instant;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::{Path, PathBuf};

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
    /// A topic whose format has fields that are formats themselves, or is missing.
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
}

impl fmt::Display for Omission {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Damage(error) => error.fmt(f),
            Self::Topic { topic, reason } => write!(f, "topic `{topic}` left out: {reason}"),
            Self::ShortSamples { topic, count } => write!(f, "{count} samples of `{topic}` are too short"),
            Self::UnknownData { id, count } => write!(f, "{count} samples of unknown topic number {id}"),
        }
    }
}

/// A flight and what is known about its log.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FlightLog {
    /// The flight.
    pub flight: Flight,
    /// The instant the log was started.
    pub started: Instant,
    /// Length of each dropout in milliseconds, and the time of the newest sample before it.
    pub dropouts: Vec<(Instant, u16)>,
    /// What was left out.
    pub omissions: Vec<Omission>,
}

/// A sample's way into the columns of a topic.
struct Subscription<'a> {
    topic: String,
    stamp: Option<usize>,
    columns: Vec<ulog::Column<'a>>,
    short: usize,
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
/// use stampfly_lab::flight_log;
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
    let reader = Reader::new(bytes)?;
    let mut log = FlightLog { started: reader.started(), ..Default::default() };
    let mut formats: BTreeMap<&str, Format<'_>> = BTreeMap::new();
    let mut subscriptions: BTreeMap<u16, Subscription<'_>> = BTreeMap::new();
    let mut unknown: BTreeMap<u16, usize> = BTreeMap::new();
    let mut refused: BTreeSet<u16> = BTreeSet::new();
    let mut meanings: BTreeMap<(String, String), Meaning> = BTreeMap::new();
    let mut newest = log.started;

    for message in reader {
        match message {
            Err(error) => log.omissions.push(Omission::Damage(error)),
            Ok(Message::Format(format)) => {
                formats.insert(format.name, format);
            }
            Ok(Message::Info { key, value }) => note_info(&mut log.flight, &mut meanings, key, value),
            Ok(Message::Parameter { name, value }) => {
                let value = match value {
                    ParameterValue::Float(value) => f64::from(value),
                    ParameterValue::Int32(value) => f64::from(value),
                };
                log.flight.parameters.entry(name.to_owned()).or_default().push((newest, value));
            }
            Ok(Message::Subscription { id, instance, topic }) => match subscribe(&formats, instance, topic) {
                Ok((subscription, columns)) => {
                    let series = log.flight.topics.entry(subscription.topic.clone()).or_default();
                    if series.columns.is_empty() {
                        series.columns = columns;
                    }
                    subscriptions.insert(id, subscription);
                }
                Err(reason) => {
                    refused.insert(id);
                    log.omissions.push(Omission::Topic { topic: topic.to_owned(), reason });
                }
            },
            Ok(Message::Data { id, payload }) => match subscriptions.get_mut(&id) {
                Some(subscription) => {
                    if let Some(at) = subscription.take(&mut log.flight, payload) {
                        newest = newest.max(at);
                    }
                }
                None if refused.contains(&id) => {}
                None => *unknown.entry(id).or_default() += 1,
            },
            Ok(Message::Text { at, text, .. }) => log.flight.events.push(Event { at, text: text.to_owned() }),
            Ok(Message::Dropout { duration }) => log.dropouts.push((newest, duration)),
            Ok(_) => {}
        }
    }

    for ((topic, field), meaning) in meanings {
        let instances =
            log.flight.topics.iter_mut().filter(|(name, _)| {
                name.strip_prefix(&topic).is_some_and(|rest| rest.is_empty() || rest.starts_with('['))
            });
        instances.for_each(|(_, series)| {
            let known = series.meanings.entry(field.clone()).or_default();
            if !meaning.unit.is_empty() {
                known.unit.clone_from(&meaning.unit);
            }
            if !meaning.names.is_empty() {
                known.names.clone_from(&meaning.names);
            }
        });
    }
    let short = subscriptions.into_values().filter(|subscription| subscription.short > 0);
    log.omissions.extend(short.map(|s| Omission::ShortSamples { topic: s.topic, count: s.short }));
    log.omissions.extend(unknown.into_iter().map(|(id, count)| Omission::UnknownData { id, count }));
    Ok(log)
}

impl Subscription<'_> {
    /// Appends a sample to its columns and returns its stamp.
    fn take(&mut self, flight: &mut Flight, payload: &[u8]) -> Option<Instant> {
        let series = flight.topics.get_mut(&self.topic)?;
        let values: Option<Vec<f64>> = self.columns.iter().map(|column| column.read(payload)).collect();
        let stamp = self.stamp.and_then(|offset| payload.get(offset..)?.first_chunk()).copied();
        let (Some(values), Some(stamp)) = (values, stamp) else {
            self.short += 1;
            return None;
        };
        // Two subscriptions of one topic with different formats cannot share columns; the first one has them.
        if values.len() != series.columns.len() {
            self.short += 1;
            return None;
        }
        let at = Instant::from_micros(u64::from_le_bytes(stamp));
        series.at.push(at);
        series.columns.iter_mut().zip(values).for_each(|(column, value)| column.values.push(value));
        Some(at)
    }
}

/// Lays out a topic, or says why it cannot be done.
fn subscribe<'a>(
    formats: &BTreeMap<&str, Format<'a>>,
    instance: u8,
    topic: &str,
) -> Result<(Subscription<'a>, Vec<Column>), String> {
    let format = formats.get(topic).ok_or("the log has no format of this name")?;
    let mut columns: Vec<_> = format.columns().collect::<Result<_, _>>().map_err(|error| error.to_string())?;
    let stamp = columns.iter().position(|c| c.field == "timestamp" && c.scalar == ulog::Scalar::U64);
    let stamp = stamp.map(|place| columns.remove(place).offset);
    if stamp.is_none() {
        return Err("the format has no timestamp".to_owned());
    }
    let named = columns.iter().map(|column| Column {
        name: column.index.map_or_else(|| column.field.to_owned(), |index| format!("{}[{index}]", column.field)),
        field: column.field.to_owned(),
        values: Vec::new(),
    });
    let named = named.collect();
    let topic = if instance == 0 { topic.to_owned() } else { format!("{topic}[{instance}]") };
    Ok((Subscription { topic, stamp, columns, short: 0 }, named))
}

/// Files a fact: a unit, names of values, or anything else as text.
fn note_info(
    flight: &mut Flight,
    meanings: &mut BTreeMap<(String, String), Meaning>,
    key: ulog::Declaration<'_>,
    value: &[u8],
) {
    if key.type_name == "char" {
        let text = String::from_utf8_lossy(value);
        if let Some(topic) = key.name.strip_prefix(UNITS_PREFIX) {
            for (field, unit) in text.split(' ').filter_map(|pair| pair.split_once('=')) {
                meanings.entry((topic.to_owned(), field.to_owned())).or_default().unit = unit.to_owned();
            }
        } else if let Some((topic, field)) = key.name.strip_prefix(NAMES_PREFIX).and_then(|rest| rest.split_once('/')) {
            let names = text.split(' ').filter_map(|pair| pair.split_once('='));
            let names = names.filter_map(|(name, number)| Some((name.to_owned(), number.parse().ok()?)));
            meanings.entry((topic.to_owned(), field.to_owned())).or_default().names = names.collect();
        } else {
            flight.info.insert(key.name.to_owned(), text.into_owned());
        }
    } else if let Some(number) = ulog::Scalar::from_name(key.type_name).and_then(|scalar| scalar.read(value)) {
        flight.info.insert(key.name.to_owned(), number.to_string());
    }
}
