//! Where things are in a log: messages, samples, key frames, fields. Tests damage a log there.

use stampfly_log::ulog::{Message, Reader};
use stampfly_types::Instant;
use std::collections::BTreeMap;
use std::ops::Range;

/// Every message of a log, in file order: its type and where its bytes are.
pub fn messages(log: &[u8]) -> Vec<(u8, Range<usize>)> {
    let mut messages = Vec::new();
    // The file begins with 16 bytes of magic and time; a message with its size, less its head of three bytes, and type.
    let mut at = 16;
    while let Some(&[low, high, kind]) = log.get(at..at + 3) {
        let end = at + 3 + usize::from(u16::from_le_bytes([low, high]));
        messages.push((kind, at..end));
        at = end;
    }
    assert_eq!(at, log.len(), "whole messages");
    messages
}

/// Where the bytes of the parts of key frames are.
pub fn key_frame_parts(log: &[u8]) -> Vec<Range<usize>> {
    let parts = messages(log).into_iter().filter(|(kind, bytes)| {
        *kind == b'M' && log[bytes.clone()].windows(9).take(32).any(|window| window == b"key_frame")
    });
    parts.map(|(_, bytes)| bytes).collect()
}

/// The log of a program that makes no key frames.
pub fn without_key_frames(log: &[u8]) -> Vec<u8> {
    let parts = key_frame_parts(log);
    assert!(!parts.is_empty());
    let mut end = 0;
    let kept: Vec<&[u8]> = parts
        .iter()
        .map(|part| {
            let kept = &log[end..part.start];
            end = part.end;
            kept
        })
        .collect();
    [&kept.concat(), &log[end..]].concat()
}

/// One message of a log that carries a sample: which topic, when, and where its bytes are.
pub struct Place {
    pub topic: String,
    pub at: Instant,
    pub payload: Range<usize>,
}

impl Place {
    /// The whole message, header and topic number included.
    pub fn message(&self) -> Range<usize> {
        self.payload.start - 5..self.payload.end
    }
}

/// Every sample of a log, in file order.
pub fn places(log: &[u8]) -> Vec<Place> {
    let mut names = BTreeMap::new();
    let mut places = Vec::new();
    for message in Reader::new(log).expect("a ULog") {
        match message.expect("an intact message") {
            Message::Subscription { id, topic, .. } => {
                names.insert(id, topic.to_owned());
            }
            Message::Data { id, payload } => {
                let start = payload.as_ptr() as usize - log.as_ptr() as usize;
                let at = Instant::from_micros(u64::from_le_bytes(*payload.first_chunk().expect("a stamp")));
                places.push(Place { topic: names[&id].clone(), at, payload: start..start + payload.len() });
            }
            _ => {}
        }
    }
    places
}

/// The first sample of a topic at or after this instant.
pub fn find(log: &[u8], topic: &str, at: Instant) -> Place {
    places(log).into_iter().find(|place| place.topic == topic && place.at >= at).expect("the flight lasts longer")
}

/// Where a field begins within the payload of a topic's samples.
pub fn offset(log: &[u8], topic: &str, field: &str, index: Option<usize>) -> usize {
    let format = Reader::new(log).expect("a ULog").find_map(|message| match message {
        Ok(Message::Format(format)) if format.name == topic => Some(format),
        _ => None,
    });
    let mut columns = format.expect("a format").columns().map(|column| column.expect("a basic type"));
    columns.find(|column| column.field == field && column.index == index).expect("a column").offset
}

/// The log without these bytes.
pub fn without(log: &[u8], range: Range<usize>) -> Vec<u8> {
    [&log[..range.start], &log[range.end..]].concat()
}
