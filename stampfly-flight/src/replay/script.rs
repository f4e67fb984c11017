//! A log as a list of what to do and what to expect.

use crate::key_frame::{KeyFrameError, is_whole};
use crate::log_schema::LogSchema;
use crate::recorder::KEY_FRAME;
use alloc::borrow::ToOwned;
use alloc::collections::BTreeMap;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;
use core::fmt;
use stampfly_bus::{Schedule, TopicInfo, TopicTable};
use stampfly_log::ActivationTopic;
use stampfly_log::trace::TOPIC_PREFIX;
use stampfly_log::ulog::{End, Message, ParameterValue, ReadError, Reader, Schema, Stamp, Topic};
use stampfly_types::{ActivationRecord, Instant};

/// Why a log cannot be replayed.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ReplayError {
    /// The file is no ULog.
    Log(ReadError),
    /// It has no activations: the program that wrote it does not record them.
    NoActivations,
    /// It is cut off or damaged, and no activation is left.
    NoneLeft(End),
    /// A topic or an activation does not look like this vehicle's.
    Schema(String),
    /// A parameter is unknown or out of range.
    Parameter(String),
    /// A key frame cannot be used.
    KeyFrame(KeyFrameError),
    /// There is no key frame to start from.
    NoKeyFrame,
    /// A sample that an activation saw is not in the log, and no key frame follows.
    Gap {
        /// The activation.
        activation: String,
        /// The instant it was told.
        now: Instant,
    },
    /// A sample from outside is not in the log, and no key frame follows.
    LostSample {
        /// Its topic.
        topic: String,
        /// The stamp of the sample after it.
        at: Instant,
    },
    /// The log says that it has lost something, and no key frame follows.
    Dropout {
        /// The stamp of the last sample or activation before it.
        at: Instant,
    },
    /// The log is damaged before there was anything to repeat, and no key frame follows.
    Damaged {
        /// The stamp of the last sample or activation before it.
        at: Instant,
    },
}

impl fmt::Display for ReplayError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Log(error) => write!(f, "{error}"),
            Self::NoActivations => f.write_str("the log holds no activations, so there is nothing to replay"),
            Self::NoneLeft(end) => write!(f, "the log holds no activations that are whole: it is {end}"),
            Self::Schema(name) => write!(f, "'{name}' is not as this program writes it: another version's log?"),
            Self::Parameter(name) => write!(f, "parameter '{name}' is unknown or out of range"),
            Self::KeyFrame(error) => write!(f, "{error}"),
            Self::NoKeyFrame => f.write_str("the log holds no key frame from there on"),
            Self::Gap { activation, now } => {
                write!(f, "the log has a gap: activation {activation} at {now} read a sample that is not in it")
            }
            Self::LostSample { topic, at } => {
                write!(f, "the log has a gap: a sample of {topic} before {at} is not in it")
            }
            Self::Dropout { at } => write!(f, "the log has a gap: a dropout after {at}"),
            Self::Damaged { at } => write!(f, "the log is damaged after {at}, and no key frame follows"),
        }
    }
}

impl core::error::Error for ReplayError {}

/// One entry of a log that matters to a replay.
pub(super) enum Entry {
    /// A sample from outside.
    Outside { topic: usize, at: Instant, generation: u32, words: Vec<u32> },
    /// A sample that a runnable published.
    Inside { topic: usize, at: Instant, generation: u32, words: Vec<u32> },
    /// A runnable has read its inputs.
    Activation(ActivationRecord),
    /// A runnable has finished, and was refused something.
    Refusals(ActivationRecord),
    /// The state of the vehicle.
    KeyFrame(Vec<u8>),
    /// Something is missing here: the writer could not keep up.
    Lost(Instant),
    /// Something is missing here: the file is damaged.
    Damaged(Instant),
}

pub(super) struct Script {
    pub(super) entries: Vec<Entry>,
    pub(super) start: Instant,
    /// How far the log is whole.
    pub(super) end: End,
    /// Is something damaged before the first sample? Then a topic may be missing.
    pub(super) is_head_damaged: bool,
}

/// What the data of one subscription is.
#[derive(Clone, Copy)]
enum Place {
    Topic(usize, Topic),
    Activation { index: u8, inputs: usize },
}

/// The vehicle a log is of: its `sys_name`. `None` when it is no log or does not say.
#[must_use]
pub fn vehicle_name(log: &[u8]) -> Option<&str> {
    Reader::new(log).ok()?.find_map(|message| match message {
        Ok(Message::Info { key, value }) if key.name == "sys_name" => core::str::from_utf8(value).ok(),
        _ => None,
    })
}

impl Script {
    /// Reads a log of this vehicle. `set` applies a parameter and says whether it could.
    pub(super) fn read<R: Schedule>(
        log: &[u8],
        mut set: impl FnMut(&str, ParameterValue) -> bool,
    ) -> Result<Self, ReplayError> {
        let schema = LogSchema::<R>::new(&[]);
        let topics = <R::Topics as TopicTable>::TOPICS;
        let place_of = |name: &str| topics.iter().position(|info| info.name == name);
        let mut places: BTreeMap<u16, Place> = BTreeMap::new();
        let mut inputs: BTreeMap<String, usize> = BTreeMap::new();
        let mut entries = Vec::new();
        let mut frame = Vec::new();
        let mut last = Instant::ZERO;
        let mut has_activations = false;
        let (mut is_head, mut is_head_damaged) = (true, false);
        let mut reader = Reader::new(log).map_err(ReplayError::Log)?;
        let start = reader.started();
        while let Some(message) = reader.next() {
            let Ok(message) = message else {
                is_head_damaged |= is_head;
                frame.clear();
                damaged(&mut entries, last, reader.end());
                continue;
            };
            match message {
                Message::Format(format) => {
                    if let Some(count) = ActivationTopic::inputs_of(&format) {
                        inputs.insert(format.name.to_owned(), count);
                    } else if let Some(topic) = place_of(format.name).and_then(|place| schema.topic(place))
                        && !topic.is_format(&format)
                    {
                        return Err(ReplayError::Schema(format.name.to_owned()));
                    }
                }
                Message::Parameter { name, value } if !set(name, value) => {
                    return Err(ReplayError::Parameter(name.to_owned()));
                }
                Message::Subscription { id, topic: name, .. } => {
                    if let Some((place, topic)) = place_of(name).and_then(|place| Some((place, schema.topic(place)?))) {
                        places.insert(id, Place::Topic(place, topic));
                    } else if let Some(runnable) = name.strip_prefix(TOPIC_PREFIX) {
                        let index = R::ACTIVATIONS.iter().position(|info| info.name == runnable);
                        let known = index.zip(inputs.get(name)).filter(|(index, count)| R::INPUTS[*index] == **count);
                        let (index, count) = known.ok_or_else(|| ReplayError::Schema(name.to_owned()))?;
                        places.insert(id, Place::Activation { index: index as u8, inputs: *count });
                    }
                }
                Message::Data { id, payload } => {
                    is_head = false;
                    let Some(place) = places.get(&id) else { continue };
                    // The formats are this vehicle's, so a sample of another size is damage that
                    // left the framing alone.
                    let Some(entry) = place.entry(topics, payload) else {
                        damaged(&mut entries, last, End::Whole);
                        continue;
                    };
                    match &entry {
                        Entry::Outside { at, .. } | Entry::Inside { at, .. } => last = *at,
                        Entry::Activation(record) | Entry::Refusals(record) => {
                            last = record.now;
                            has_activations = true;
                        }
                        _ => {}
                    }
                    entries.push(entry);
                }
                Message::MultiInfo { continued, key, value } if key.name == KEY_FRAME => {
                    if !continued {
                        frame.clear();
                    }
                    frame.extend_from_slice(value);
                    // A frame whose other parts are missing cannot be used.
                    if is_whole(&frame) {
                        entries.push(Entry::KeyFrame(core::mem::take(&mut frame)));
                    }
                }
                Message::Dropout { .. } => {
                    frame.clear();
                    entries.push(Entry::Lost(last));
                }
                _ => {}
            }
        }
        let end = reader.end();
        match has_activations {
            true => Ok(Self { entries, start, end, is_head_damaged }),
            false if end.is_whole() => Err(ReplayError::NoActivations),
            false => Err(ReplayError::NoneLeft(end)),
        }
    }
}

/// Something is missing here. What was read before it may be missing bytes as well, because a
/// message is as long as it says: only where the file ends is it known to be whole.
fn damaged(entries: &mut Vec<Entry>, last: Instant, end: End) {
    if matches!(end, End::Cut { .. }) || matches!(entries.last(), Some(Entry::Damaged(_))) {
        return;
    }
    entries.pop();
    entries.push(Entry::Damaged(last));
}

impl Place {
    /// What a payload says; `None` when it is not of this place.
    fn entry(&self, topics: &'static [TopicInfo], payload: &[u8]) -> Option<Entry> {
        match *self {
            Self::Topic(topic, ref layout) => {
                let info = topics.get(topic)?;
                let mut words = vec![0; info.words];
                let Stamp { at, generation } = layout.decode(payload, &mut words)?;
                Some(match info.is_outside {
                    true => Entry::Outside { topic, at, generation, words },
                    false => Entry::Inside { topic, at, generation, words },
                })
            }
            Self::Activation { index, inputs } => {
                let record = ActivationTopic::decode(payload, inputs).filter(|record| record.index == index)?;
                Some(if record.refused == 0 { Entry::Activation(record) } else { Entry::Refusals(record) })
            }
        }
    }
}
