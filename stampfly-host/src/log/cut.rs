//! A part of a flight.
//!
//! Everything that describes the log is kept: facts, parameters, formats, topics. Of the samples and activations only those between
//! the two instants are. A mark says that something is missing before them, and so `stampfly replay` goes on at the first key frame of
//! the part, as it does after any gap. Where the log is damaged, the part has such a mark as well, and lacks the sample before
//! the damage: a byte that is missing in it shows in the message behind it.

use stampfly_flight::recorder::KEY_FRAME;
use stampfly_log::ulog::{End, FlagBits, Message, ReadError, Reader, Scalar};
use stampfly_types::Instant;
use std::collections::BTreeMap;

/// A dropout of an unknown length: type, and a duration of zero.
const GAP: [u8; 5] = [2, 0, b'O', 0, 0];
/// Where the flags begin in a log, behind the header of the file and that of their message.
const FLAGS: usize = 19;

/// Cuts out what lies between these instants, both included. Says how far the log was whole, too.
///
/// # Errors
/// When it is no log.
pub fn cut(log: &[u8], from: Instant, to: Instant) -> Result<(Vec<u8>, End), ReadError> {
    let mut reader = Reader::new(log)?;
    let mut kept = log.get(..reader.offset()).unwrap_or_default().to_vec();
    // Where the time stamp of each format is, and of each subscription.
    let (mut stamps, mut ids) = (BTreeMap::new(), BTreeMap::new());
    let (mut newest, mut is_marked) = (reader.started(), false);
    // Where the last sample begins in the part.
    let mut last_sample = None;
    loop {
        let begin = reader.offset();
        let Some(message) = reader.next() else { return Ok((kept, reader.end())) };
        let Ok(message) = message else {
            // What was there could be missed, unless nothing follows.
            if reader.offset() < log.len() && (from..=to).contains(&newest) {
                kept.truncate(last_sample.take().unwrap_or(kept.len()));
                kept.extend(GAP);
            }
            continue;
        };
        let is_sample = matches!(message, Message::Data { .. });
        let keeps = match message {
            Message::Format(format) => {
                let mut columns = format.columns().map_while(Result::ok);
                let stamp = columns.find(|column| column.field == "timestamp" && column.scalar == Scalar::U64);
                stamps.insert(format.name.to_owned(), stamp.map(|column| column.offset));
                true
            }
            Message::Subscription { id, topic, .. } => {
                ids.insert(id, stamps.get(topic).copied().flatten());
                true
            }
            Message::Data { id, payload } => {
                let stamp = ids.get(&id).copied().flatten().and_then(|at| payload.get(at..)?.first_chunk().copied());
                let stamp = stamp.map(|stamp| Instant::from_micros(u64::from_le_bytes(stamp)));
                // Zero is no time, unless the log begins there.
                let is_time = |at: &Instant| *at != Instant::ZERO || reader.started() == Instant::ZERO;
                newest = stamp.filter(is_time).unwrap_or(newest);
                (from..=to).contains(&newest)
            }
            Message::Text { at, .. } => (from..=to).contains(&at),
            // A key frame is written right after the samples before it.
            Message::MultiInfo { key, .. } | Message::Info { key, .. } if key.name == KEY_FRAME => {
                (from..=to).contains(&newest)
            }
            Message::Dropout { .. } | Message::Sync => (from..=to).contains(&newest),
            _ => true,
        };
        if keeps {
            let describes = newest < from;
            if !describes && !is_marked && newest > reader.started() && from > reader.started() {
                kept.extend(GAP);
                is_marked = true;
            }
            last_sample = is_sample.then_some(kept.len());
            kept.extend(log.get(begin..reader.offset()).unwrap_or_default());
        }
        if let Message::FlagBits(_) = message {
            forget_appended(&mut kept);
        }
    }
}

/// Appended parts follow the rest in the part without a seam, and nothing is where it was.
fn forget_appended(kept: &mut [u8]) {
    if let Some(flags) = kept.get_mut(FLAGS..FLAGS + 40) {
        let (features, places) = flags.split_at_mut(16);
        if let Some(incompatible) = features.get_mut(8).filter(|bits| **bits & FlagBits::DATA_APPENDED != 0) {
            *incompatible &= !FlagBits::DATA_APPENDED;
            places.fill(0);
        }
    }
}
