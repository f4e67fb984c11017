//! Logs of other writers, and damaged logs.

use crate::common::{TOPICS, small_log};
use proptest::prelude::*;
use stampfly_log::ulog::{
    End, FieldError, FlagBits, Format, Level, Message, ParameterValue, ReadError, ReadErrorKind, Reader,
};
use stampfly_types::Instant;

/// A log made manually from the format description, which `pyulog` 1.3.0 reads without errors.
const HAND_BUILT: &[u8] = include_bytes!("../hand_built.ulog");

#[test]
fn the_hand_built_log_is_read() {
    let reader = Reader::new(HAND_BUILT).unwrap();
    assert_eq!(reader.started(), Instant::from_micros(1_000));
    let messages: Vec<_> = reader.map(Result::unwrap).collect();
    assert_eq!(messages[0], Message::FlagBits(FlagBits::default()));
    let Message::Format(format) = messages[1] else { panic!("{:?}", messages[1]) };
    let columns: Vec<_> = format.columns().map(Result::unwrap).collect();
    let names: Vec<_> = columns.iter().map(|c| (c.field, c.index)).collect();
    let q = [0, 1, 2, 3].map(|index| ("q", Some(index)));
    assert_eq!(names, [&[("timestamp", None)], &q[..], &[("roll", None), ("mode", None)]].concat());
    let mut rolls = Vec::new();
    let mut others = Vec::new();
    for message in &messages[2..] {
        match message {
            Message::Data { id: 0, payload } => {
                assert_eq!(columns[1].read(payload), Some(1.0));
                assert_eq!(columns[6].read(payload), Some(2.0));
                rolls.push((columns[0].read(payload).unwrap(), columns[5].read(payload).unwrap() as f32));
            }
            other => others.push(*other),
        }
    }
    assert_eq!(rolls, [(1_000.0, 0.0), (3_500.0, 0.1), (6_000.0, 0.2)]);
    let Message::Info { key, value } = others[0] else { panic!("{:?}", others[0]) };
    assert_eq!((key.type_name, key.count, key.name, value), ("char", Some(5), "sys_name", &b"xcopt"[..]));
    assert_eq!(
        others[2..],
        [
            Message::Parameter { name: "RATE_P", value: ParameterValue::Float(0.2) },
            Message::Parameter { name: "CTL_FREQ", value: ParameterValue::Int32(4_000) },
            Message::Subscription { id: 0, instance: 0, topic: "attitude" },
            Message::Sync,
            Message::Text { level: Level::Info, tag: None, at: Instant::from_micros(3_000), text: "armed" },
            Message::Dropout { duration: 12 },
            Message::Parameter { name: "RATE_P", value: ParameterValue::Float(0.3) },
        ]
    );
}

/// A header, and flags that list one appended part.
fn head(appended: u64, incompatible: u8) -> Vec<u8> {
    let mut log = HAND_BUILT[..16].to_vec();
    log.extend([40, 0, b'B', 0, 0, 0, 0, 0, 0, 0, 0, incompatible, 0, 0, 0, 0, 0, 0, 0]);
    log.extend(appended.to_le_bytes());
    log.extend([0; 16]);
    log
}

fn message(kind: u8, payload: &[u8]) -> Vec<u8> {
    let mut bytes = (payload.len() as u16).to_le_bytes().to_vec();
    bytes.push(kind);
    bytes.extend(payload);
    bytes
}

fn items(log: &[u8]) -> Vec<Result<Message<'_>, ReadErrorKind>> {
    Reader::new(log).unwrap().skip(1).map(|item| item.map_err(|error| error.kind)).collect()
}

#[test]
fn appended_data_is_found_behind_a_cut_off_message() {
    let mut log = head(0, FlagBits::DATA_APPENDED);
    log.extend(&message(b'O', &[7, 0]));
    log.extend(&message(b'D', &[0; 50])[..20]);
    let part = log.len() as u64;
    log[16 + 3 + 16..][..8].copy_from_slice(&part.to_le_bytes());
    log.extend(&message(b'O', &[9, 0]));
    let expected =
        [Ok(Message::Dropout { duration: 7 }), Err(ReadErrorKind::Truncated), Ok(Message::Dropout { duration: 9 })];
    assert_eq!(items(&log), expected);
}

#[test]
fn unknown_demands_are_refused_and_unknown_messages_are_passed_on() {
    let refused = Reader::new(&head(0, 2)).err();
    assert_eq!(refused, Some(ReadError { offset: 16, kind: ReadErrorKind::Incompatible }));
    let mut log = head(0, 0);
    log.extend(message(b'Z', b"news"));
    log.extend(message(b'P', b"\x08double x........"));
    log.extend(message(b'C', b"5\x02\x00\x01\0\0\0\0\0\0\0hello"));
    log.extend(message(b'Q', b"\x01\x07float p\0\0\x80\x3f"));
    log.extend(message(b'R', &[1, 0]));
    log.extend(message(b'M', b"\x01\x09char[2] mok"));
    let items = items(&log);
    assert_eq!(items[0], Ok(Message::Unknown { kind: b'Z', payload: b"news" }));
    assert_eq!(items[1], Err(ReadErrorKind::Malformed(b'P')));
    let text = Message::Text { level: Level::Notice, tag: Some(2), at: Instant::from_micros(1), text: "hello" };
    assert_eq!(items[2], Ok(text));
    assert_eq!(items[3], Ok(Message::ParameterDefault { types: 1, name: "p", value: ParameterValue::Float(1.0) }));
    assert_eq!(items[4], Ok(Message::Unsubscription { id: 1 }));
    assert!(matches!(items[5], Ok(Message::MultiInfo { continued: true, key, value: b"ok" }) if key.name == "m"));
}

#[test]
fn nested_and_broken_formats_are_reported() {
    let nested = Format { name: "x", fields: "uint64_t timestamp;esc_report[8] esc;float after;" };
    let columns: Vec<_> = nested.columns().collect();
    assert_eq!(columns.len(), 2);
    assert_eq!(columns[1], Err(FieldError::Nested("esc_report")));
    for fields in ["float", "float[ x", "float[-1] x", "float[99999999] x", "double[9000] x", "[3] x"] {
        let last = Format { name: "x", fields }.columns().last();
        assert!(matches!(last, Some(Err(_))), "{fields}: {last:?}");
    }
}

#[test]
fn framing_is_found_again_at_the_next_mark() {
    let mut log = head(0, 0);
    log.extend([0xff; 40]);
    log.extend(message(b'S', &[0x2f, 0x73, 0x13, 0x20, 0x25, 0x0c, 0xbb, 0x12]));
    log.extend(message(b'O', &[3, 0]));
    assert_eq!(items(&log), [Err(ReadErrorKind::Truncated), Ok(Message::Sync), Ok(Message::Dropout { duration: 3 })]);
}

/// Reads the whole log. The reader must finish, in at most as many steps as there are bytes.
fn read_all(log: &[u8]) -> (usize, usize) {
    let Ok(mut reader) = Reader::new(log) else { return (0, 0) };
    let (mut intact, mut broken) = (0, 0);
    let mut at = reader.offset();
    while let Some(item) = reader.next() {
        assert!(reader.offset() > at && reader.offset() <= log.len(), "the reader moves on");
        at = reader.offset();
        match item {
            Ok(Message::Format(format)) => {
                intact += 1;
                let _ = format.columns().count();
                let _ = format.declarations().count();
                let _ = stampfly_log::ActivationTopic::inputs_of(&format);
            }
            Ok(Message::Data { payload, .. }) => {
                intact += 1;
                for topic in TOPICS {
                    let _ = topic.decode(payload, &mut vec![0; topic.words()]);
                }
                let _ = stampfly_log::ActivationTopic::decode(payload, 3);
            }
            Ok(_) => intact += 1,
            Err(error) => {
                broken += 1;
                assert!(error.offset < log.len());
            }
        }
    }
    (intact, broken)
}

#[test]
fn a_log_cut_off_anywhere_gives_all_that_was_whole() {
    let log = small_log();
    let mut ends = vec![];
    let mut reader = Reader::new(&log).unwrap();
    while reader.next().is_some() {
        ends.push(reader.offset());
    }
    for length in 16..log.len() {
        let whole = ends.iter().filter(|end| **end <= length).count();
        let cut = usize::from(length > 16 && !ends.contains(&length));
        assert_eq!(read_all(&log[..length]), (whole, cut), "{length}");
    }
    assert!((0..16).all(|length| Reader::new(&log[..length]).is_err()));
}

#[test]
fn the_end_says_what_was_not_read() {
    let end = |log: &[u8]| {
        let mut reader = Reader::new(log).unwrap();
        reader.by_ref().for_each(drop);
        reader.end()
    };
    let log = small_log();
    assert_eq!(end(&log), End::Whole);
    let mut whole = vec![16];
    let mut reader = Reader::new(&log).unwrap();
    while reader.next().is_some() {
        whole.push(reader.offset());
    }
    for length in 16..log.len() {
        let at = whole[whole.partition_point(|end| *end <= length) - 1];
        let expected = if at == length { End::Whole } else { End::Cut { at, rest: length - at } };
        assert_eq!(end(&log[..length]), expected, "{length}");
    }
    // Two invalid messages: formats whose text is not UTF-8.
    let formats: Vec<_> = whole.windows(2).filter(|ends| log.get(ends[0] + 2) == Some(&b'F')).take(2).collect();
    let mut damaged = log.clone();
    formats.iter().for_each(|ends| damaged[ends[0] + 3] = 0xff);
    let (at, skipped) = (formats[0][0], formats.iter().map(|ends| ends[1] - ends[0]).sum());
    assert_eq!(end(&damaged), End::Damaged { at, places: 2, skipped });
    let sentence = format!("damaged at byte {at} and in 1 places more: {skipped} bytes were passed over");
    assert_eq!(end(&damaged).to_string(), sentence);
    // Zeros at the end, as some file systems leave them, count as damage: no message begins with a
    // zero byte, and the last message before them may be incomplete.
    let (zeros, last) = ([&log[..], &[0; 100]].concat(), whole[whole.len() - 2]);
    assert_eq!(end(&zeros), End::Damaged { at: last, places: 1, skipped: zeros.len() - last });
}

#[test]
fn one_flipped_bit_costs_no_more_than_the_way_to_the_next_mark() {
    let log = small_log();
    let (total, _) = read_all(&log);
    let mut reader = Reader::new(&log).unwrap();
    let first_mark = loop {
        if reader.next().unwrap() == Ok(Message::Sync) {
            break reader.offset();
        }
    };
    // After the first mark there is one every seventeen messages. A damaged size may include the
    // next one as well.
    for offset in first_mark..log.len() {
        for bit in 0..8 {
            let mut damaged = log.clone();
            damaged[offset] ^= 1 << bit;
            let (intact, _) = read_all(&damaged);
            assert!(intact + 2 * 17 >= total, "byte {offset} bit {bit}: {intact} of {total}");
        }
    }
}

proptest! {
    #[test]
    fn random_bytes_are_survived(bytes in prop::collection::vec(any::<u8>(), 0..2_000)) {
        read_all(&bytes);
        let mut log = small_log();
        log.truncate(16);
        log.extend(bytes);
        read_all(&log);
    }

    #[test]
    fn random_damage_is_survived(damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..20)) {
        let mut log = small_log();
        for (index, byte) in damage {
            let index = index.index(log.len());
            log[index] = byte;
        }
        read_all(&log);
    }

    #[test]
    fn random_formats_are_survived(fields in "[a-z0-9_ ;\\[\\]]{0,60}") {
        let format = Format { name: "x", fields: &fields };
        prop_assert!(format.columns().take(70_000).count() < 70_000);
    }
}
