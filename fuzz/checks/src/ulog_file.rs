//! Bytes of a log file.

use stampfly_log::ActivationTopic;
use stampfly_log::ulog::{End, Format, Message, Reader, Topic};
use stampfly_types::Message as _;
use stampfly_types::messages::{FlightStatus, ImuData, StateEstimate};

const TOPICS: [Topic; 3] = [
    Topic { name: "sensor_imu", fields: ImuData::FIELDS },
    Topic { name: "estimate_state", fields: StateEstimate::FIELDS },
    Topic { name: "flight_status", fields: FlightStatus::FIELDS },
];
/// Columns of a message: its payload has at most 65,535 bytes.
const COLUMNS: usize = 70_000;

/// The whole input is the file.
pub fn ulog(data: &[u8]) {
    let Ok(mut reader) = Reader::new(data) else { return };
    let mut formats: Vec<Format<'_>> = Vec::new();
    let mut at = reader.offset();
    while let Some(item) = reader.next() {
        assert!(reader.offset() > at && reader.offset() <= data.len(), "from {at} to {}", reader.offset());
        at = reader.offset();
        match item {
            Ok(Message::Format(format)) => {
                assert!(format.columns().take(COLUMNS).count() < COLUMNS);
                // Those that were declared before, and itself.
                let find = |name: &str| formats.iter().chain([&format]).rev().take(8).find(|known| known.name == name);
                let mut unfolded = format.unfolded(|name| find(name).copied());
                assert!(unfolded.by_ref().take(COLUMNS).count() < COLUMNS);
                assert!(unfolded.steps() < COLUMNS + 1_024, "{} steps", unfolded.steps());
                let _ = format.declarations().filter(Result::is_ok).count();
                let _ = TOPICS.iter().filter(|topic| topic.is_format(&format)).count();
                formats.push(format);
            }
            Ok(Message::Data { payload, .. }) => read(payload, &formats),
            Ok(_) => {}
            Err(error) => assert!(error.offset < data.len()),
        }
    }
    match reader.end() {
        End::Whole => {}
        End::Cut { at, rest } => assert_eq!(at + rest, data.len()),
        End::Damaged { at, places, skipped } => assert!(places > 0 && at + skipped <= data.len()),
    }
}

/// Reads a payload by every format that the file has declared, and as our own topics.
fn read(payload: &[u8], formats: &[Format<'_>]) {
    // A file can declare as many formats as it likes: a few are enough here.
    for format in formats.iter().take(8) {
        for column in format.columns().take(64).flatten() {
            let _ = column.read(payload);
        }
        if let Some(inputs) = ActivationTopic::inputs_of(format) {
            let _ = ActivationTopic::decode(payload, inputs);
        }
    }
    for topic in &TOPICS {
        let mut words = vec![0; topic.words()];
        let stamp = topic.decode(payload, &mut words);
        assert!(stamp.is_none() || payload.len() == topic.size());
    }
}
