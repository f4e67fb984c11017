//! What a replay publishes beside what the log says was published.

use alloc::collections::BTreeMap;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::fmt;
use stampfly_bus::{Schedule, TopicInfo, TopicTable};
use stampfly_types::{ActivationRecord, Instant, Value, leaves};

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

impl Difference {
    /// The whole state differs, though nothing published has: a component has learned something else.
    pub(super) fn of_state(clock: Instant) -> Self {
        Self {
            activation: "(key frame)".into(),
            now: clock,
            topic: "(state of the vehicle)".into(),
            generation: 0,
            field: "(bytes)".into(),
            recorded: "one state".into(),
            replayed: "another".into(),
        }
    }
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

/// A sample of the replay that the log has yet to confirm.
struct Published {
    at: Instant,
    words: Vec<u32>,
    activation: u8,
    now: Instant,
}

/// Samples of the replay that the log has yet to confirm, by topic and generation.
pub(super) struct Comparison {
    topics: &'static [TopicInfo],
    published: BTreeMap<(usize, u32), Published>,
    /// The newest confirmed generation of each topic.
    confirmed: BTreeMap<usize, u32>,
}

impl Comparison {
    pub(super) fn new(topics: &'static [TopicInfo]) -> Self {
        Self { topics, published: BTreeMap::new(), confirmed: BTreeMap::new() }
    }

    /// The replay has published a sample.
    pub(super) fn published(
        &mut self,
        topic: usize,
        at: Instant,
        generation: u32,
        words: &[u32],
        by: &ActivationRecord,
    ) {
        let sample = Published { at, words: words.to_vec(), activation: by.index, now: by.now };
        self.published.insert((topic, generation), sample);
    }

    /// The log has a sample: was it published?
    pub(super) fn recorded<R: Schedule>(
        &mut self,
        topic: usize,
        at: Instant,
        generation: u32,
        words: &[u32],
    ) -> Option<Difference> {
        let info = &self.topics[topic];
        let difference = |activation: &str, now, field, recorded, replayed| Difference {
            activation: activation.into(),
            now,
            topic: info.name.into(),
            generation,
            field,
            recorded,
            replayed,
        };
        self.confirmed.insert(topic, generation);
        let Some(sample) = self.published.remove(&(topic, generation)) else {
            let (recorded, replayed) = ("a sample".into(), "nothing".into());
            return Some(difference(info.publisher, at, "(the whole sample)".into(), recorded, replayed));
        };
        let activation = R::ACTIVATIONS[usize::from(sample.activation)].name;
        if sample.at != at {
            let (recorded, replayed) = (at.to_string(), sample.at.to_string());
            return Some(difference(activation, sample.now, "timestamp".into(), recorded, replayed));
        }
        let (field, recorded, replayed) = first_difference(info, words, &sample.words)?;
        Some(difference(activation, sample.now, field, recorded, replayed))
    }

    /// The log is at its end: did the replay publish something that the log passes over? What comes after the newest
    /// sample of its topic does not count: the log may have been cut there.
    pub(super) fn unrecorded<R: Schedule>(&self) -> Option<Difference> {
        let passed = |(topic, generation): &(usize, u32)| {
            self.confirmed.get(topic).is_some_and(|newest| newest.wrapping_sub(*generation) < u32::MAX / 2)
        };
        let ((topic, generation), sample) = self.published.iter().find(|(key, _)| passed(key))?;
        Some(Difference {
            activation: <R as Schedule>::ACTIVATIONS[usize::from(sample.activation)].name.into(),
            now: sample.now,
            topic: <R::Topics as TopicTable>::TOPICS[*topic].name.into(),
            generation: *generation,
            field: "(the whole sample)".into(),
            recorded: "nothing".into(),
            replayed: "a sample".into(),
        })
    }
}

/// The first leaf field that differs, as recorded and as replayed.
fn first_difference(info: &TopicInfo, recorded: &[u32], replayed: &[u32]) -> Option<(String, String, String)> {
    if recorded == replayed {
        return None;
    }
    for leaf in leaves(info.fields) {
        for element in 0..leaf.count {
            // As words: NaN is not equal to itself, but the same words are the same sample.
            if leaf.words(recorded, element) != leaf.words(replayed, element) {
                let [was, is] = [recorded, replayed].map(|words| leaf.value(words, element));
                let name = if leaf.count > 1 { format!("{}[{element}]", leaf.name) } else { leaf.name.to_string() };
                return Some((name, show(was), show(is)));
            }
        }
    }
    Some(("(number of words)".into(), recorded.len().to_string(), replayed.len().to_string()))
}

/// Every digit of a number, so that what differs is seen to differ.
fn show(value: Option<Value>) -> String {
    match value {
        Some(Value::F32(number)) => format!("{number:?}"),
        Some(Value::F64(number)) => format!("{number:?}"),
        Some(value) => value.to_string(),
        None => "nothing".into(),
    }
}
