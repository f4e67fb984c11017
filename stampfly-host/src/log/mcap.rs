//! MCAP, for Foxglove and PlotJuggler: a channel a topic, samples as JSON with a schema that has the units.
//!
//! The container is the crate `mcap`'s. JSON is longer than ULog's bytes, and every viewer reads it
//! without being told how; the ULog is shorter, and both programs open it as well.

use crate::flight::{Flight, Series};
use serde_json::{Map, Value, json};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{Seek, Write};
use std::sync::Arc;

/// Writes the topics of a flight that `wants` says, in the order of their instants. What has no
/// time, with a stamp of zero, comes when the recording was started.
///
/// # Errors
/// When `out` does not take it.
pub fn write<W: Write + Seek>(flight: &Flight, wants: impl Fn(&str) -> bool, out: W) -> ::mcap::McapResult<()> {
    let library = concat!("stampfly ", env!("CARGO_PKG_VERSION"));
    let mut writer = ::mcap::WriteOptions::new().library(library).compression(None).create(out)?;
    let topics: Vec<_> = flight.topics.iter().filter(|(name, _)| wants(name)).collect();
    let mut channels = Vec::new();
    for (name, series) in &topics {
        let schema = ::mcap::Schema {
            id: channels.len() as u16 + 1,
            name: (*name).clone(),
            encoding: "jsonschema".into(),
            data: Cow::Owned(schema(series).to_string().into_bytes()),
        };
        channels.push(Arc::new(::mcap::Channel {
            id: channels.len() as u16,
            topic: (*name).clone(),
            schema: Some(Arc::new(schema)),
            message_encoding: "json".into(),
            metadata: BTreeMap::new(),
        }));
    }
    let mut order: Vec<_> = topics
        .iter()
        .enumerate()
        .flat_map(|(topic, (_, series))| series.at.iter().enumerate().map(move |(row, at)| (at, topic, row)))
        .map(|(at, topic, row)| (if flight.is_time(*at) { *at } else { flight.started }, topic, row))
        .collect();
    order.sort_unstable();
    let mut written: Vec<_> = topics.iter().map(|(_, series)| (*series, fields(series), 0_u32)).collect();
    for (at, topic, row) in order {
        let (Some((series, fields, count)), Some(channel)) = (written.get_mut(topic), channels.get(topic)) else {
            continue;
        };
        let time = at.as_micros().saturating_mul(1_000);
        writer.write(&::mcap::Message {
            channel: channel.clone(),
            sequence: *count,
            log_time: time,
            publish_time: time,
            data: Cow::Owned(sample(series, fields, row).to_string().into_bytes()),
        })?;
        *count += 1;
    }
    writer.finish()?;
    Ok(())
}

/// A field: name, and the places of its columns.
type Field<'s> = (&'s str, Vec<usize>);

/// Fields of a series. One with an index is a list.
fn fields(series: &Series) -> Vec<Field<'_>> {
    let mut fields: Vec<Field<'_>> = Vec::new();
    for (place, column) in series.columns.iter().enumerate() {
        match fields.last_mut().filter(|(name, _)| *name == column.field) {
            Some((_, places)) => places.push(place),
            None => fields.push((&column.field, vec![place])),
        }
    }
    fields
}

fn is_list(series: &Series, places: &[usize]) -> bool {
    places.len() > 1 || places.first().and_then(|at| series.columns.get(*at)).is_some_and(|c| c.name != c.field)
}

fn schema(series: &Series) -> Value {
    let mut properties = Map::new();
    for (name, places) in fields(series) {
        let kind = match is_list(series, &places) {
            true => json!({ "type": "array", "items": { "type": "number" } }),
            false => json!({ "type": "number" }),
        };
        let (mut kind, unit) = (kind, series.unit(name));
        if !unit.is_empty() {
            kind["description"] = unit.into();
        }
        properties.insert(name.to_owned(), kind);
    }
    json!({ "type": "object", "properties": properties })
}

fn sample(series: &Series, fields: &[Field<'_>], row: usize) -> Value {
    // What is no number is `null` in JSON.
    let number = |place: &usize| -> Value {
        let value = series.columns.get(*place).and_then(|column| column.values.get(row)).copied();
        value.and_then(|value| super::shown(value).parse().ok()).map_or(Value::Null, Value::Number)
    };
    let mut object = Map::new();
    for (name, places) in fields {
        let value = match (is_list(series, places), places.as_slice()) {
            (false, [place]) => number(place),
            _ => places.iter().map(number).collect::<Vec<_>>().into(),
        };
        object.insert((*name).to_owned(), value);
    }
    object.into()
}
