//! A flight as columns over time, for plots, metrics and exports.
//!
//! It comes from a log ([`crate::flight_log`]), from a recording of the repository's `lab`, or message
//! by message from a simulation. Numbers are `f64`, so 64-bit counters beyond 2⁵³ are rounded: for a
//! replay use the log itself.

use stampfly_types::{FieldInfo, FieldKind, Instant, Message, Value, leaves};
use std::collections::BTreeMap;
use std::sync::Arc;

/// What a field of numbers means.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Meaning {
    /// Unit; empty when dimensionless or unknown.
    pub unit: String,
    /// Names of values; of bit masks, for a set of flags. All instances of a topic share them.
    pub names: Arc<[(String, u32)]>,
}

/// One scalar over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Column {
    /// `position[0]`, or `height` when the field is no array. A field of a message in a message is `wind_speed`.
    pub name: String,
    /// The field the scalar belongs to, `position`.
    pub field: String,
    /// One value per sample. NaN where there was none.
    pub values: Vec<f64>,
}

/// One topic over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// The instant each sample is valid for, in log order.
    pub at: Vec<Instant>,
    /// The scalars of the topic, in order. All as long as `at`.
    pub columns: Vec<Column>,
    /// What the fields mean, where known.
    pub meanings: BTreeMap<String, Meaning>,
}

impl Series {
    /// An empty series with the columns of a message.
    #[must_use]
    pub fn of_fields(fields: &'static [FieldInfo]) -> Self {
        let mut series = Self::default();
        for leaf in leaves(fields) {
            let field = leaf.name.to_string();
            let name = |index: usize| if leaf.count == 1 { field.clone() } else { format!("{field}[{index}]") };
            let column = |index| Column { name: name(index), field: field.clone(), values: Vec::new() };
            series.columns.extend((0..leaf.count).map(column));
            let names = match leaf.kind {
                FieldKind::Enum(names) | FieldKind::Flags(names) => names,
                _ => &[],
            };
            let unit = leaf.unit.to_owned();
            let names: Arc<[_]> = names.iter().map(|(name, number)| ((*name).to_owned(), *number)).collect();
            if !unit.is_empty() || !names.is_empty() {
                series.meanings.insert(field, Meaning { unit, names });
            }
        }
        series
    }

    /// Appends the words of a message with these fields. Missing words give NaN.
    pub fn push_words(&mut self, at: Instant, fields: &'static [FieldInfo], words: &[u32]) {
        self.at.push(at);
        let elements = leaves(fields).flat_map(|leaf| (0..leaf.count).map(move |element| leaf.value(words, element)));
        for (column, value) in self.columns.iter_mut().zip(elements) {
            column.values.push(value.map_or(f64::NAN, Value::as_f64));
        }
    }

    /// The values of a column.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|column| column.name == name).map(|column| column.values.as_slice())
    }

    /// The first `N` elements of an array field.
    #[must_use]
    pub fn columns_of<const N: usize>(&self, field: &str) -> Option<[&[f64]; N]> {
        let mut columns = self.columns.iter().filter(|column| column.field == field);
        let columns: Vec<_> = columns.by_ref().take(N).map(|column| column.values.as_slice()).collect();
        columns.try_into().ok()
    }

    /// Unit of a field; empty when it has none.
    #[must_use]
    pub fn unit(&self, field: &str) -> &str {
        self.meanings.get(field).map_or("", |meaning| &meaning.unit)
    }

    /// Names of a field's values or flags; empty when it has none.
    #[must_use]
    pub fn names(&self, field: &str) -> &[(String, u32)] {
        self.meanings.get(field).map_or(&[], |meaning| &meaning.names)
    }

    /// Index of the newest sample at or before this instant.
    #[must_use]
    pub fn index_at(&self, at: Instant) -> Option<usize> {
        self.at.partition_point(|stamp| *stamp <= at).checked_sub(1)
    }
}

/// A line of text in a flight.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Event {
    /// When.
    pub at: Instant,
    /// What.
    pub text: String,
}

/// A whole flight.
///
/// ```
/// use stampfly_host::Flight;
/// use stampfly_types::{Instant, messages::PowerData};
///
/// let mut flight = Flight::default();
/// flight.push("sensor_power", Instant::ZERO, &PowerData { voltage: 4.1, current: 2.0, power: 8.2 });
/// let power = &flight.topics["sensor_power"];
/// assert_eq!(power.column("current"), Some(&[2.0][..]));
/// assert_eq!(power.unit("voltage"), "V");
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Flight {
    /// The instant its recording was started.
    pub started: Instant,
    /// Topics by name.
    pub topics: BTreeMap<String, Series>,
    /// Facts about the flight.
    pub info: BTreeMap<String, String>,
    /// Parameters, with each value they had and since when; the first value since the start.
    pub parameters: BTreeMap<String, Vec<(Instant, f64)>>,
    /// Lines of text.
    pub events: Vec<Event>,
}

impl Flight {
    /// Appends one message to a topic, which is made when new.
    pub fn push<M: Message>(&mut self, topic: &str, at: Instant, message: &M) {
        self.push_words(topic, at, M::FIELDS, message.to_words().as_ref());
    }

    /// Appends one message, as words, to a topic, which is made when new.
    pub fn push_words(&mut self, topic: &str, at: Instant, fields: &'static [FieldInfo], words: &[u32]) {
        if !self.topics.contains_key(topic) {
            self.topics.insert(topic.to_owned(), Series::of_fields(fields));
        }
        if let Some(series) = self.topics.get_mut(topic) {
            series.push_words(at, fields, words);
        }
    }

    /// Is this stamp a time? PX4 stamps a sample with zero when it has no time for it: in a
    /// recording that was started later, zero says nothing about when.
    #[must_use]
    pub fn is_time(&self, at: Instant) -> bool {
        at != Instant::ZERO || self.started == Instant::ZERO
    }

    /// The earliest and the latest stamp of any topic, among those that are times.
    #[must_use]
    pub fn span(&self) -> Option<(Instant, Instant)> {
        let stamps = || self.topics.values().flat_map(|series| &series.at).filter(|at| self.is_time(**at));
        Some((*stamps().min()?, *stamps().max()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::messages::{FlightStatus, StateEstimate};

    #[test]
    fn columns_follow_the_schema() {
        let mut flight = Flight::default();
        let estimate = StateEstimate { height: 2.0, ..Default::default() };
        flight.push("estimate_state", Instant::from_micros(5), &estimate);
        flight.push("flight_status", Instant::from_micros(7), &FlightStatus::default());
        let series = &flight.topics["estimate_state"];
        assert_eq!(series.column("height"), Some(&[2.0][..]));
        assert_eq!(series.columns_of::<4>("attitude").map(|q| q.map(|c| c[0])), Some([1.0, 0.0, 0.0, 0.0]));
        assert_eq!(series.unit("velocity"), "m/s");
        assert_eq!(series.unit("attitude"), "");
        assert_eq!(flight.topics["flight_status"].names("phase")[3], ("Armed".to_owned(), 3));
        assert_eq!(flight.span(), Some((Instant::from_micros(5), Instant::from_micros(7))));
        assert!(series.columns.iter().all(|column| column.values.len() == series.at.len()));
    }

    #[test]
    fn words_that_are_missing_are_not_a_number() {
        let mut series = Series::of_fields(StateEstimate::FIELDS);
        series.push_words(Instant::ZERO, StateEstimate::FIELDS, &[1.0f32.to_bits()]);
        assert_eq!(series.columns[0].values, [1.0]);
        assert!(series.columns[1..].iter().all(|column| column.values[0].is_nan()));
    }

    #[test]
    fn the_newest_sample_up_to_an_instant() {
        let series = Series { at: vec![Instant::from_micros(10), Instant::from_micros(20)], ..Default::default() };
        assert_eq!(
            [9, 10, 19, 20, 99].map(|at| series.index_at(Instant::from_micros(at))),
            [None, Some(0), Some(0), Some(1), Some(1)]
        );
    }
}
