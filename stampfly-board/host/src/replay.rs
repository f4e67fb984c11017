//! Replay: the flight again, from what came from outside.
//!
//! A log holds the topics that drivers and links published, and for every activation which samples it saw. From those
//! and the parameters alone every runnable is run again, in the recorded order, and everything it publishes is compared
//! with the log, bit for bit. The first difference is named.

use crate::recorder::TOPICS;
use stampfly_board::vehicle::{Assembled, assemble};
use stampfly_board::{VehicleConfig, parameters, plan, wiring};
use stampfly_bus::{Activation, InputRecord};
use stampfly_log::ActivationTopic;
use stampfly_log::trace::TOPIC_PREFIX;
use stampfly_log::ulog::{Message, ParameterValue, ReadError, Reader};
use stampfly_types::{FieldInfo, FieldKind, Instant};
use std::collections::BTreeMap;
use std::fmt;

/// What came out of a replay that could be made.
#[derive(Clone, Debug, PartialEq)]
pub struct Replay {
    /// Activations repeated.
    pub activations: u64,
    /// Samples compared.
    pub samples: u64,
    /// The first sample that differs.
    pub difference: Option<Difference>,
}

/// Where a replay and its log part.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// The activation that published the sample.
    pub activation: String,
    /// The instant it was told.
    pub now: Instant,
    /// The topic.
    pub topic: String,
    /// The sample's number.
    pub generation: u32,
    /// The first field that differs.
    pub field: String,
    /// What the log says.
    pub recorded: String,
    /// What the replay says.
    pub replayed: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "activation {} at {}: topic {} sample {}: field {}: recorded {}, replayed {}",
            self.activation, self.now, self.topic, self.generation, self.field, self.recorded, self.replayed
        )
    }
}

/// Why a log cannot be replayed.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ReplayError {
    /// The file is no intact ULog.
    Log(ReadError),
    /// It has no activations: it was not written by this program.
    NoActivations,
    /// A topic or an activation does not look like this program's.
    Schema(String),
    /// A parameter is unknown or out of range.
    Parameter(String),
    /// The log has a gap: a sample that an activation saw is not in it.
    Gap {
        /// The activation.
        activation: String,
        /// The instant it was told.
        now: Instant,
    },
}

impl fmt::Display for ReplayError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Log(error) => write!(f, "{error}"),
            Self::NoActivations => write!(f, "the log holds no activations, so there is nothing to replay"),
            Self::Schema(name) => write!(f, "'{name}' is not as this program writes it: another version's log?"),
            Self::Parameter(name) => write!(f, "parameter '{name}' is unknown or out of range"),
            Self::Gap { activation, now } => {
                write!(f, "the log has a gap: activation {activation} at {now} read a sample that is not in it")
            }
        }
    }
}

impl std::error::Error for ReplayError {}

/// One entry of the log that matters here.
enum Entry {
    /// A sample somebody outside published.
    Outside { topic: usize, at: Instant, words: Vec<u32> },
    /// An activation.
    Activation { index: usize, record: stampfly_log::Activation },
}

/// A recorded sample of a topic that a runnable publishes.
type Recorded = BTreeMap<(usize, u32), (Instant, Vec<u32>)>;

struct Script {
    entries: Vec<Entry>,
    recorded: Recorded,
    config: VehicleConfig,
    start: Instant,
}

/// Is the publisher of this topic none of the runnables?
pub(crate) fn is_outside(topic: usize) -> bool {
    let publisher = wiring::TOPICS[topic].publisher;
    !plan::ACTIVATIONS.iter().any(|info| info.name == publisher)
}

fn read(bytes: &[u8]) -> Result<Script, ReplayError> {
    let mut script = Script {
        entries: Vec::new(),
        recorded: Recorded::new(),
        config: VehicleConfig::default(),
        start: Instant::ZERO,
    };
    let mut places: BTreeMap<u16, Place> = BTreeMap::new();
    let mut formats: BTreeMap<String, usize> = BTreeMap::new();
    let reader = Reader::new(bytes).map_err(ReplayError::Log)?;
    script.start = reader.started();
    for message in reader {
        match message.map_err(ReplayError::Log)? {
            Message::Format(format) => {
                if let Some(inputs) = ActivationTopic::inputs_of(&format) {
                    formats.insert(format.name.to_owned(), inputs);
                } else if let Some(topic) = TOPICS.iter().find(|topic| topic.name == format.name)
                    && !topic.is_format(&format)
                {
                    return Err(ReplayError::Schema(format.name.to_owned()));
                }
            }
            Message::Parameter { name, value: ParameterValue::Float(value) } => {
                parameters::set(&mut script.config, name, value)
                    .map_err(|_| ReplayError::Parameter(name.to_owned()))?;
            }
            Message::Subscription { id, topic: name, .. } => {
                if let Some(topic) = wiring::TOPICS.iter().position(|info| info.name == name) {
                    places.insert(id, Place::Topic(topic));
                } else if let Some(runnable) = name.strip_prefix(TOPIC_PREFIX) {
                    let index = plan::ACTIVATIONS.iter().position(|info| info.name == runnable);
                    let (Some(index), Some(inputs)) = (index, formats.get(name)) else {
                        return Err(ReplayError::Schema(name.to_owned()));
                    };
                    places.insert(id, Place::Activation { index, inputs: *inputs });
                }
            }
            Message::Data { id, payload } => match places.get(&id) {
                Some(Place::Topic(topic)) => script.add_sample(*topic, payload)?,
                Some(Place::Activation { index, inputs }) => {
                    let name = plan::ACTIVATIONS[*index].name;
                    let record = ActivationTopic::decode(payload, *inputs);
                    let record = record.ok_or_else(|| ReplayError::Schema(name.to_owned()))?;
                    script.entries.push(Entry::Activation { index: *index, record });
                }
                None => {}
            },
            _ => {}
        }
    }
    if script.entries.iter().any(|entry| matches!(entry, Entry::Activation { .. })) {
        Ok(script)
    } else {
        Err(ReplayError::NoActivations)
    }
}

#[derive(Clone, Copy)]
enum Place {
    Topic(usize),
    Activation { index: usize, inputs: usize },
}

impl Script {
    fn add_sample(&mut self, topic: usize, payload: &[u8]) -> Result<(), ReplayError> {
        let mut words = vec![0; wiring::TOPICS[topic].words];
        let stamp = TOPICS[topic].decode(payload, &mut words);
        let stamp = stamp.ok_or_else(|| ReplayError::Schema(TOPICS[topic].name.to_owned()))?;
        if is_outside(topic) {
            self.entries.push(Entry::Outside { topic, at: stamp.at, words });
        } else {
            self.recorded.insert((topic, stamp.generation), (stamp.at, words));
        }
        Ok(())
    }
}

/// Flies a log again.
///
/// # Errors
/// When the log cannot be read, is not one of ours, or has a gap. A difference is no error: see [`Replay::difference`].
pub fn replay(bytes: &[u8]) -> Result<Replay, ReplayError> {
    let Script { entries, mut recorded, config, start } = read(bytes)?;
    let mut bus = wiring::Bus::new();
    let wiring::Split { ports, mut taps, heads } = bus.split(None);
    let Assembled { mut flight_loop, mut outside } = assemble(ports, heads, &config, start);
    let inputs = flight_loop.count_inputs();
    let mut result = Replay { activations: 0, samples: 0, difference: None };
    for entry in entries {
        match entry {
            Entry::Outside { topic, at, words } => {
                outside
                    .publish_words(topic, at, &words)
                    .ok_or_else(|| ReplayError::Schema(wiring::TOPICS[topic].name.to_owned()))?;
            }
            Entry::Activation { index, record } => {
                if record.inputs().len() != inputs[index] {
                    return Err(ReplayError::Schema(format!("{TOPIC_PREFIX}{}", plan::ACTIVATIONS[index].name)));
                }
                let inputs: Vec<InputRecord> = record
                    .inputs()
                    .iter()
                    .map(|input| InputRecord { generation: input.generation, taken: input.taken })
                    .collect();
                let again = flight_loop.replay(index, Activation::replay(record.now, &inputs, record.refused));
                let name = || plan::ACTIVATIONS[index].name.to_owned();
                if again.is_missing_input() {
                    return Err(ReplayError::Gap { activation: name(), now: record.now });
                }
                result.activations += 1;
                taps.drain(&mut |id, at, generation, words| {
                    if is_outside(id as usize) || result.difference.is_some() {
                        return;
                    }
                    result.samples += 1;
                    let before = recorded.remove(&(id as usize, generation));
                    if before.as_ref().is_some_and(|(was_at, was)| *was_at == at && was == words) {
                        return;
                    }
                    let found = describe(id as usize, before.as_ref(), at, words);
                    result.difference = Some(Difference {
                        activation: name(),
                        now: record.now,
                        topic: wiring::TOPICS[id as usize].name.to_owned(),
                        generation,
                        field: found.0,
                        recorded: found.1,
                        replayed: found.2,
                    });
                });
                if result.difference.is_some() {
                    return Ok(result);
                }
            }
        }
    }
    if let Some((topic, generation)) = recorded.keys().next() {
        let (at, _) = recorded[&(*topic, *generation)];
        result.difference = Some(Difference {
            activation: wiring::TOPICS[*topic].publisher.to_owned(),
            now: at,
            topic: wiring::TOPICS[*topic].name.to_owned(),
            generation: *generation,
            field: "(the whole sample)".into(),
            recorded: "a sample".into(),
            replayed: "nothing".into(),
        });
    }
    Ok(result)
}

/// The first field that differs, as recorded and as replayed.
fn describe(
    topic: usize,
    before: Option<&(Instant, Vec<u32>)>,
    at: Instant,
    words: &[u32],
) -> (String, String, String) {
    let Some((was_at, was)) = before else {
        return ("(the whole sample)".into(), "nothing".into(), "a sample".into());
    };
    if *was_at != at {
        return ("timestamp".into(), was_at.to_string(), at.to_string());
    }
    let mut first = 0;
    for field in wiring::TOPICS[topic].fields {
        let part = first..first + field.words;
        if was[part.clone()] != words[part.clone()] {
            let each = field.words / field.count;
            let element = (0..field.count).find(|k| {
                let range = first + k * each..first + (k + 1) * each;
                was[range.clone()] != words[range]
            });
            let element = element.unwrap_or(0);
            let name = if field.count > 1 { format!("{}[{element}]", field.name) } else { field.name.to_owned() };
            let range = first + element * each..first + (element + 1) * each;
            return (name, show(field, &was[range.clone()]), show(field, &words[range]));
        }
        first += field.words;
    }
    ("(none)".into(), String::new(), String::new())
}

fn show(field: &FieldInfo, words: &[u32]) -> String {
    let word = words.first().copied().unwrap_or_default();
    match field.kind {
        FieldKind::F32 => format!("{:?}", f32::from_bits(word)),
        FieldKind::I32 | FieldKind::I16 => word.cast_signed().to_string(),
        FieldKind::U64 => (u64::from(word) | u64::from(words.get(1).copied().unwrap_or_default()) << 32).to_string(),
        FieldKind::Enum(names) => {
            names.iter().find(|(_, number)| *number == word).map_or_else(|| word.to_string(), |(n, _)| (*n).to_owned())
        }
        _ => word.to_string(),
    }
}
