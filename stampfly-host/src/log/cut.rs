//! A part of a flight.
//!
//! Everything that describes the log is kept: facts, parameters, formats, topics. Of the samples and activations only those between
//! the two instants are. A mark says that something is missing before them, and so `stampfly replay` goes on at the first key frame of
//! the part, as it does after any gap.

use stampfly_flight::recorder::KEY_FRAME;
use stampfly_log::ulog::{Message, ReadError, Reader, Scalar};
use stampfly_types::Instant;
use std::collections::BTreeMap;

/// A dropout of an unknown length: type, and a duration of zero.
const GAP: [u8; 5] = [2, 0, b'O', 0, 0];

/// Cuts out what lies between these instants, both included.
///
/// # Errors
/// When it is no log, or one that is damaged: cutting would hide it.
pub fn cut(log: &[u8], from: Instant, to: Instant) -> Result<Vec<u8>, ReadError> {
    let mut reader = Reader::new(log)?;
    let mut kept = log.get(..reader.offset()).unwrap_or_default().to_vec();
    // Where the time stamp of each format is, and of each subscription.
    let (mut stamps, mut ids) = (BTreeMap::new(), BTreeMap::new());
    let (mut newest, mut is_marked) = (reader.started(), false);
    loop {
        let begin = reader.offset();
        let Some(message) = reader.next() else { return Ok(kept) };
        let keeps = match message? {
            Message::Format(format) => {
                let stamp = format.columns().flatten().find(|c| c.field == "timestamp" && c.scalar == Scalar::U64);
                stamps.insert(format.name.to_owned(), stamp.map(|column| column.offset));
                true
            }
            Message::Subscription { id, topic, .. } => {
                ids.insert(id, stamps.get(topic).copied().flatten());
                true
            }
            Message::Data { id, payload } => {
                let stamp = ids.get(&id).copied().flatten().and_then(|at| payload.get(at..)?.first_chunk().copied());
                newest = stamp.map_or(newest, |stamp| Instant::from_micros(u64::from_le_bytes(stamp)));
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
            kept.extend(log.get(begin..reader.offset()).unwrap_or_default());
        }
    }
}
