//! From the messages of a log to the columns of its topics.

use super::Omission;
use crate::flight::{Column, Flight};
use stampfly_log::ulog::{Format, Path, Scalar};
use stampfly_types::Instant;
use std::collections::BTreeMap;
use std::fmt::{self, Write};

/// Topics of a log, instances counted one by one. PX4's logs have up to 300.
const MAX_TOPICS: usize = 4_096;
/// Columns of all topics of a log. PX4's logs have up to 10,000.
const MAX_COLUMNS: usize = 1 << 16;
/// Declarations and elements looked at to lay all topics out.
const MAX_STEPS: usize = 1 << 20;
/// Bytes of a column's name.
const MAX_NAME: usize = 255;
/// Series that one name may have because its formats differ.
const MAX_FORMATS: usize = 16;

/// Formats, subscriptions, and what may still be laid out.
pub(super) struct Topics<'a> {
    formats: BTreeMap<&'a str, Format<'a>>,
    /// By number; `None` for one that was left out.
    subscriptions: BTreeMap<u16, Option<Subscription>>,
    unknown: BTreeMap<u16, usize>,
    topics: usize,
    columns: usize,
    steps: usize,
}

impl Default for Topics<'_> {
    fn default() -> Self {
        Self {
            formats: BTreeMap::new(),
            subscriptions: BTreeMap::new(),
            unknown: BTreeMap::new(),
            topics: MAX_TOPICS,
            columns: MAX_COLUMNS,
            steps: MAX_STEPS,
        }
    }
}

/// A sample's way into the columns of a topic.
struct Subscription {
    topic: String,
    /// Where the time stamp is.
    stamp: usize,
    /// Type and place of every column.
    places: Vec<(Scalar, usize)>,
    short: usize,
}

/// A name that is no longer than it may be.
#[derive(Default)]
struct Name(String);

impl Name {
    fn of(path: Path<'_>) -> Option<String> {
        let mut name = Self::default();
        write!(name, "{path}").ok().map(|()| name.0)
    }
}

impl fmt::Write for Name {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        if self.0.len() + text.len() > MAX_NAME {
            return Err(fmt::Error);
        }
        self.0 += text;
        Ok(())
    }
}

/// A topic laid out.
struct Layout {
    stamp: usize,
    places: Vec<(Scalar, usize)>,
    columns: Vec<Column>,
}

impl<'a> Topics<'a> {
    pub(super) fn format(&mut self, format: Format<'a>) {
        self.formats.insert(format.name, format);
    }

    /// A topic begins, or goes on under another number: instances and repetitions are as common as
    /// first ones.
    pub(super) fn subscribe(&mut self, flight: &mut Flight, id: u16, instance: u8, topic: &str) -> Result<(), String> {
        self.subscriptions.insert(id, None);
        let Layout { stamp, places, columns } = self.lay_out(topic)?;
        let name = if instance == 0 { topic.to_owned() } else { format!("{topic}[{instance}]") };
        // Two formats of one name cannot share columns: the later one is a series of its own.
        let names = (1..=MAX_FORMATS).map(|n| if n == 1 { name.clone() } else { format!("{name}#{n}") });
        let has_these = |name: &String| {
            let theirs = flight.topics.get(name).map(|series| series.columns.iter().map(|column| &column.name));
            theirs.is_none_or(|theirs| theirs.eq(columns.iter().map(|column| &column.name)))
        };
        let topic = names.into_iter().find(has_these).ok_or("its format changes too often")?;
        if !flight.topics.contains_key(&topic) {
            self.topics = self.topics.checked_sub(1).ok_or("the log has too many topics")?;
            flight.topics.entry(topic.clone()).or_default().columns = columns;
        }
        self.subscriptions.insert(id, Some(Subscription { topic, stamp, places, short: 0 }));
        Ok(())
    }

    fn lay_out(&mut self, topic: &str) -> Result<Layout, String> {
        let format = self.formats.get(topic).ok_or("the log has no format of this name")?;
        let mut layout = Layout { stamp: 0, places: Vec::new(), columns: Vec::new() };
        let mut stamp = None;
        let mut unfolded = format.unfolded(|name| self.formats.get(name).copied());
        let mut before = 0;
        loop {
            if self.steps == 0 || self.columns == 0 {
                return Err("the log has too many columns".into());
            }
            let column = unfolded.next();
            self.steps = self.steps.saturating_sub(unfolded.steps() - before);
            before = unfolded.steps();
            let Some(column) = column else { break };
            let column = column.map_err(|error| error.to_string())?;
            if column.path.is("timestamp") && column.scalar == Scalar::U64 && stamp.is_none() {
                stamp = Some(column.offset);
                continue;
            }
            let short =
                |path| Name::of(path).ok_or_else(|| format!("a field has a name of more than {MAX_NAME} bytes"));
            let (name, field) = (short(column.path)?, short(column.path.field())?);
            self.columns -= 1;
            layout.places.push((column.scalar, column.offset));
            layout.columns.push(Column { name, field, values: Vec::new() });
        }
        layout.stamp = stamp.ok_or("the format has no timestamp")?;
        Ok(layout)
    }

    /// Appends a sample to the columns of its topic and returns its stamp.
    pub(super) fn sample(&mut self, flight: &mut Flight, id: u16, payload: &[u8]) -> Option<Instant> {
        let Some(subscription) = self.subscriptions.get_mut(&id) else {
            *self.unknown.entry(id).or_default() += 1;
            return None;
        };
        let Subscription { topic, stamp, places, short } = subscription.as_mut()?;
        let series = flight.topics.get_mut(topic)?;
        let value = |(scalar, offset): &(Scalar, usize)| scalar.read(payload.get(*offset..)?);
        let values: Option<Vec<f64>> = places.iter().map(value).collect();
        let at = payload.get(*stamp..).and_then(<[u8]>::first_chunk).copied().map(u64::from_le_bytes);
        let (Some(values), Some(at)) = (values, at) else {
            *short += 1;
            return None;
        };
        let at = Instant::from_micros(at);
        series.at.push(at);
        series.columns.iter_mut().zip(values).for_each(|(column, value)| column.values.push(value));
        Some(at)
    }

    pub(super) fn omissions(self) -> impl Iterator<Item = Omission> {
        let short = self.subscriptions.into_values().flatten().filter(|subscription| subscription.short > 0);
        let short = short.map(|s| Omission::ShortSamples { topic: s.topic, count: s.short });
        short.chain(self.unknown.into_iter().map(|(id, count)| Omission::UnknownData { id, count }))
    }
}
