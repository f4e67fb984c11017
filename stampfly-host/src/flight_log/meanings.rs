//! Facts of a log: units, names of values, and anything else as text.

use crate::flight::{Flight, Meaning};
use stampfly_log::ulog::{Declaration, NAMES_PREFIX, Scalar, UNITS_PREFIX};
use std::collections::BTreeMap;

/// Bytes of a unit. A longer one is none.
const MAX_UNIT: usize = 64;

/// What the fields of each format mean, until all topics are known.
#[derive(Default)]
pub(super) struct Meanings(BTreeMap<String, BTreeMap<String, Meaning>>);

impl Meanings {
    /// Keeps a meaning. Returns the name and the text of every other fact.
    pub(super) fn take(&mut self, key: Declaration<'_>, value: &[u8]) -> Option<(String, String)> {
        if key.type_name != "char" {
            let number = Scalar::from_name(key.type_name)?.read(value)?;
            return Some((key.name.to_owned(), number.to_string()));
        }
        let text = String::from_utf8_lossy(value);
        if let Some(topic) = key.name.strip_prefix(UNITS_PREFIX) {
            for (field, unit) in text.split(' ').filter_map(|pair| pair.split_once('=')) {
                if unit.len() <= MAX_UNIT {
                    self.of(topic, field).unit = unit.to_owned();
                }
            }
        } else if let Some((topic, field)) = key.name.strip_prefix(NAMES_PREFIX).and_then(|rest| rest.split_once('/')) {
            let names = text.split(' ').filter_map(|pair| pair.split_once('='));
            let names = names.filter_map(|(name, number)| Some((name.to_owned(), number.parse().ok()?)));
            self.of(topic, field).names = names.collect();
        } else {
            return Some((key.name.to_owned(), text.into_owned()));
        }
        None
    }

    fn of(&mut self, topic: &str, field: &str) -> &mut Meaning {
        self.0.entry(topic.to_owned()).or_default().entry(field.to_owned()).or_default()
    }

    /// Gives every series what its format's fields mean; instances share it.
    pub(super) fn file(&self, flight: &mut Flight) {
        for (name, series) in &mut flight.topics {
            let format = name.split_once(['[', '#']).map_or(name.as_str(), |(format, _)| format);
            let Some(known) = self.0.get(format) else { continue };
            let fields = series.columns.iter().filter_map(|column| known.get_key_value(&column.field));
            series.meanings = fields.map(|(field, meaning)| (field.clone(), meaning.clone())).collect();
        }
    }
}
