//! Round trips: every word of every message and every activation is read as it was written, for any
//! bits.

use crate::common::{ACTIVATIONS, Bytes, Odd, TOPICS, small_log, start};
use proptest::prelude::*;
use stampfly_log::ActivationTopic;
use stampfly_log::ulog::{Definitions, Full, Message, Ram, Reader, Sample, Sink, Stamp, Topic, WriteError};
use stampfly_types::messages::{FlightStatus, PowerData, TofData};
use stampfly_types::{ActivationRecord, InputRecord};
use stampfly_types::{FieldKind, Instant, Message as _, leaves};

/// Words that a message of this topic can have: any bits where all are valid, small numbers
/// elsewhere.
fn words(topic: &Topic) -> impl Strategy<Value = Vec<u32>> + use<> {
    let fields = topic.fields;
    prop::collection::vec(any::<u32>(), topic.words()).prop_map(move |mut words| {
        for leaf in leaves(fields) {
            for word in &mut words[leaf.offset..][..leaf.size()] {
                *word = match leaf.kind {
                    FieldKind::U8 | FieldKind::Bool | FieldKind::Enum(_) => *word & 0xff,
                    FieldKind::U16 => *word & 0xffff,
                    FieldKind::I16 => i32::from(*word as i16).cast_unsigned(),
                    FieldKind::I8 => i32::from(*word as i8).cast_unsigned(),
                    _ => *word,
                };
            }
        }
        words
    })
}

fn any_sample() -> impl Strategy<Value = (usize, u64, u32, Vec<u32>)> {
    (0..TOPICS.len()).prop_flat_map(|topic| (Just(topic), any::<u64>(), any::<u32>(), words(&TOPICS[topic])))
}

/// The samples of a log as (topic, at, generation, words), decoded with the topics above.
fn samples(log: &[u8]) -> Vec<(usize, u64, u32, Vec<u32>)> {
    let mut samples = Vec::new();
    for message in Reader::new(log).unwrap() {
        if let Message::Data { id, payload } = message.unwrap()
            && let Some(topic) = TOPICS.get(usize::from(id))
        {
            let mut words = vec![0; topic.words()];
            let Stamp { at, generation } = topic.decode(payload, &mut words).unwrap();
            samples.push((usize::from(id), at.as_micros(), generation, words));
        }
    }
    samples
}

/// Number, instance and name of every topic that a log subscribes.
fn subscriptions(log: &[u8]) -> Vec<(u16, u8, String)> {
    let of = |message| match message {
        Message::Subscription { id, instance, topic } => Some((id, instance, topic.to_owned())),
        _ => None,
    };
    Reader::new(log).unwrap().filter_map(|message| of(message.unwrap())).collect()
}

#[test]
fn topics_of_one_name_are_instances() {
    const RANGE: Topic = Topic { name: "range", fields: TofData::FIELDS };
    const POWER: Topic = Topic { name: "power", fields: PowerData::FIELDS };
    const INSTANCES: &[Topic] = &[RANGE, POWER, RANGE];
    let mut log = Definitions::start(Bytes(Vec::new()), Instant::ZERO).unwrap().data(INSTANCES).unwrap();
    for (topic, distance) in [(0, 0.5), (2, 1.5)] {
        let words = TofData { distance, ..TofData::default() }.to_words();
        log.sample(topic, &Sample { at: Instant::ZERO, generation: 1, words: &words }).unwrap();
    }
    let log = log.into_sink().0;
    let named = [(0, 0, "range"), (1, 0, "power"), (2, 1, "range")].map(|(id, n, name)| (id, n, name.to_owned()));
    assert_eq!(subscriptions(&log), named);
    let formats = Reader::new(&log).unwrap().filter(|message| matches!(message, Ok(Message::Format(_)))).count();
    assert_eq!(formats, 2, "one description a name");

    const OTHER: &[Topic] = &[RANGE, Topic { name: "range", fields: PowerData::FIELDS }];
    let refused = Definitions::start(Bytes(Vec::new()), Instant::ZERO).unwrap().data(OTHER).err();
    assert!(matches!(refused, Some(WriteError::TwoFormats("range"))), "two things of one name are not instances");
}

proptest! {
    #[test]
    fn every_word_comes_back(written in prop::collection::vec(any_sample(), 0..30)) {
        let mut log = start();
        for (topic, at, generation, words) in &written {
            log.sample(*topic, &Sample { at: Instant::from_micros(*at), generation: *generation, words }).unwrap();
        }
        prop_assert_eq!(samples(&log.into_sink().0), written);
    }

    #[test]
    fn every_activation_comes_back(
        now: u64, refused: u32, kind in 0..ACTIVATIONS.len(), inputs: [(u32, u16); 3],
    ) {
        let topic = ACTIVATIONS[kind];
        let mut record = ActivationRecord::new(topic.index, Instant::from_micros(now));
        record.refused = refused;
        for (generation, taken) in &inputs[..topic.inputs] {
            record.push(InputRecord { generation: *generation, taken: *taken }).unwrap();
        }
        let mut log = start();
        log.activation(&record).unwrap();
        let log = log.into_sink().0;
        let read: Vec<_> = Reader::new(&log).unwrap().filter_map(|message| match message.unwrap() {
            Message::Data { payload, .. } => ActivationTopic::decode(payload, topic.inputs),
            _ => None,
        }).collect();
        prop_assert_eq!(read, vec![record]);
    }

    #[test]
    fn numbers_beyond_their_type_are_refused(word in 0x100u32..) {
        let mut words = FlightStatus::default().to_words();
        words[0] = word;
        let sample = Sample { at: Instant::ZERO, generation: 0, words: &words };
        prop_assert_eq!(start().sample(5, &sample), Err(WriteError::OutOfRange("phase")));
    }
}

#[test]
fn formats_explain_the_data() {
    let log = small_log();
    let mut formats = Vec::new();
    let mut infos = Vec::new();
    for message in Reader::new(&log).unwrap() {
        match message.unwrap() {
            Message::Format(format) => formats.push(format),
            Message::Info { key, value } => infos.push((key.name, std::str::from_utf8(value).unwrap())),
            _ => {}
        }
    }
    for (format, topic) in formats.iter().zip(TOPICS) {
        assert!(topic.is_format(format), "{}", topic.name);
        let size = format.columns().map(Result::unwrap).map(|c| c.offset + c.scalar.size()).max();
        assert_eq!(size, Some(topic.size()), "{}", topic.name);
    }
    for (format, activation) in formats[TOPICS.len()..].iter().zip(ACTIVATIONS) {
        assert!(activation.is_format(format), "{}", activation.name);
        assert_eq!(ActivationTopic::inputs_of(format), Some(activation.inputs));
    }
    assert!(!TOPICS[0].is_format(&formats[1]));
    assert_eq!(
        formats[0].fields,
        "uint64_t timestamp;uint32_t generation;float[3] accel;float[3] gyro;float temperature;float accel_peak;"
    );
    let odd = "uint64_t wide;uint64_t[2] wides;int16_t signed;int16_t[3] signeds;uint16_t half;int32_t integer;\
               uint64_t at;int64_t both_ways;double precise;int8_t small;int8_t[40] many;uint8_t maybe_present;\
               float[3] maybe;uint8_t part_0_known_present;uint64_t part_0_known;double part_0_share;\
               uint8_t part_1_known_present;uint64_t part_1_known;double part_1_share;";
    assert_eq!(formats[TOPICS.len() - 1].fields, format!("uint64_t timestamp;uint32_t generation;{odd}"));
    let units = "wide=us wides=us at=us both_ways=us maybe=m/s part_0_known=us part_1_known=us";
    assert!(infos.contains(&("units/odd", units)));
    assert!(infos.contains(&("units/sensor_imu", "accel=m/s^2 gyro=rad/s temperature=degC accel_peak=m/s^2")));
    assert!(infos.contains(&("names/flight_status/mode", "Acro=0 Stabilize=1 AltHold=2 PosHold=3")));
    assert!(
        infos
            .iter()
            .any(|(key, names)| *key == "names/system_alert/active" && names.starts_with("COMM_LOST=1 IMPACT=2 "))
    );
}

#[test]
fn wrong_samples_are_refused_and_leave_no_trace() {
    let mut log = start();
    let before = log.sink().0.len();
    let short = Sample { at: Instant::ZERO, generation: 0, words: &[0; 7] };
    assert_eq!(log.sample(0, &short), Err(WriteError::WordCount));
    let long = Sample { at: Instant::ZERO, generation: 0, words: &[0; 9] };
    assert_eq!(log.sample(0, &long), Err(WriteError::WordCount));
    assert_eq!(log.sample(99, &short), Err(WriteError::UnknownTopic));
    assert_eq!(log.activation(&ActivationRecord::new(1, Instant::ZERO)), Err(WriteError::UnknownTopic));
    assert_eq!(log.activation(&ActivationRecord::new(3, Instant::ZERO)), Err(WriteError::WordCount));
    assert_eq!(log.text(stampfly_log::ulog::Level::Info, Instant::ZERO, &"x".repeat(5_000)), Err(WriteError::TooLong));
    assert_eq!((log.sink().0.len(), log.lost()), (before, 0));
}

#[test]
fn too_long_a_key_is_an_error_and_a_key_at_the_limit_is_not() {
    let mut log = Definitions::start(Bytes::default(), Instant::ZERO).unwrap();
    assert_eq!(log.info(&"k".repeat(250), "value"), Err(WriteError::TooLong));
    assert_eq!(log.info(&"k".repeat(247), "value"), Ok(()), "`char[5] ` and 247 bytes are 255");
    assert_eq!(log.parameter(&"p".repeat(250), 1.0.into()), Err(WriteError::TooLong));
    assert_eq!(log.info("k", &"v".repeat(3_000)), Err(WriteError::TooLong));
}

/// Refuses all messages while `closed`.
struct Gate {
    bytes: Vec<u8>,
    closed: bool,
}

impl Sink for &mut Gate {
    type Error = ();
    fn write(&mut self, bytes: &[u8]) -> Result<(), ()> {
        (!self.closed).then(|| self.bytes.extend_from_slice(bytes)).ok_or(())
    }
}

/// A sink that can be closed from outside while a writer owns it.
struct Shared<'a>(&'a std::cell::RefCell<Gate>);

impl Sink for Shared<'_> {
    type Error = ();
    fn write(&mut self, bytes: &[u8]) -> Result<(), ()> {
        (&mut *self.0.borrow_mut()).write(bytes)
    }
}

#[test]
fn a_dropout_is_counted_and_marked_once() {
    let gate = std::cell::RefCell::new(Gate { bytes: Vec::new(), closed: false });
    let mut log = Definitions::start(Shared(&gate), Instant::ZERO).unwrap().data(TOPICS).unwrap();
    let words = stampfly_types::messages::PowerData::default().to_words();
    for (millis, closed) in [(0, false), (10, true), (15, true), (40, false), (50, false)] {
        gate.borrow_mut().closed = closed;
        let sample = Sample { at: Instant::from_millis(millis), generation: 0, words: &words };
        assert_eq!(log.sample(2, &sample), if closed { Err(WriteError::Sink(())) } else { Ok(()) });
    }
    assert_eq!(log.lost(), 2);
    let bytes = &gate.borrow().bytes;
    let seen: Vec<_> = Reader::new(bytes)
        .unwrap()
        .filter_map(|message| match message.unwrap() {
            Message::Data { .. } => Some("data".to_owned()),
            Message::Dropout { duration } => Some(format!("{duration} ms lost")),
            _ => None,
        })
        .collect();
    assert_eq!(seen, ["data", "30 ms lost", "data", "data"]);
}

#[test]
fn a_full_memory_keeps_a_readable_log() {
    let mut memory = [0; 3_000];
    let mut log = Definitions::start(Ram::new(&mut memory), Instant::ZERO).unwrap().data(&TOPICS[..2]).unwrap();
    let words = [0; 8];
    let result =
        (0..).find_map(|n| log.sample(0, &Sample { at: Instant::from_micros(n), generation: 0, words: &words }).err());
    assert_eq!(result, Some(WriteError::Sink(Full)));
    assert!(Reader::new(log.sink().written()).unwrap().all(|message| message.is_ok()));
}

#[test]
fn decoding_refuses_other_sizes() {
    let topic = Topic { name: "odd", fields: Odd::FIELDS };
    let payload = vec![0; topic.size()];
    let mut words = vec![0; topic.words()];
    assert!(topic.decode(&payload, &mut words).is_some());
    assert!(topic.decode(&payload[1..], &mut words).is_none());
    assert!(topic.decode(&payload, &mut words[1..]).is_none());
    assert!(ActivationTopic::decode(&[0; 22], 1).is_some());
    assert!(ActivationTopic::decode(&[0; 23], 1).is_none());
    assert!(ActivationTopic::decode(&[0; 22], usize::MAX).is_none());
}
