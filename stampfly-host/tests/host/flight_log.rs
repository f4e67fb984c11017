//! Logs of ours and of others, whole and broken, become series.

use crate::foreign_log::{begun, format, hostile, px4_like, sample, subscribe};
use proptest::prelude::*;
use stampfly_host::flight_log::{self, LogErrorKind, Omission};
use stampfly_log::ulog::{Definitions, End, Level, ReadErrorKind, Sample, Sink, Topic};
use stampfly_types::messages::{FlightStatus, StateEstimate};
use stampfly_types::{Duration, Instant, Message};

struct Bytes(Vec<u8>);

impl Sink for Bytes {
    type Error = std::convert::Infallible;
    fn write(&mut self, bytes: &[u8]) -> Result<(), Self::Error> {
        self.0.extend_from_slice(bytes);
        Ok(())
    }
}

/// A small log of ours.
pub fn log() -> Vec<u8> {
    let topics = [
        Topic { name: "estimate_state", fields: StateEstimate::FIELDS },
        Topic { name: "flight_status", fields: FlightStatus::FIELDS },
    ];
    let mut log = Definitions::start(Bytes(Vec::new()), Instant::from_micros(500)).unwrap();
    log.info("sys_name", "StampFly").unwrap();
    log.parameter("gain", 1.5.into()).unwrap();
    let mut log = log.data(&topics[..]).unwrap();
    for n in 0..50u32 {
        let at = Instant::from_micros(1_000 * u64::from(n + 1));
        let estimate = StateEstimate { height: n as f32, ..Default::default() };
        log.sample(0, &Sample { at, generation: n, words: &estimate.to_words() }).unwrap();
        if n % 10 == 0 {
            let mode = FlightStatus { transitions: n, ..Default::default() };
            log.sample(1, &Sample { at, generation: n, words: &mode.to_words() }).unwrap();
            log.sync().unwrap();
        }
    }
    log.text(Level::Info, Instant::from_micros(20_000), "hello").unwrap();
    log.parameter("gain", 2.5.into()).unwrap();
    log.into_sink().0
}

#[test]
fn our_log_becomes_series_with_units_and_names() {
    let log = flight_log::parse(&log()).unwrap();
    assert_eq!(log.omissions, []);
    let flight = log.flight;
    assert_eq!(flight.started, Instant::from_micros(500));
    let estimate = &flight.topics["estimate_state"];
    assert_eq!(estimate.at.len(), 50);
    assert_eq!(estimate.column("height").unwrap(), (0..50).map(f64::from).collect::<Vec<_>>());
    assert_eq!(estimate.columns_of::<3>("velocity").unwrap()[2].len(), 50);
    assert_eq!(estimate.unit("velocity"), "m/s");
    assert_eq!(flight.topics["flight_status"].column("transitions").unwrap(), [0.0, 10.0, 20.0, 30.0, 40.0]);
    assert_eq!(flight.topics["flight_status"].names("phase")[5], ("Flying".to_owned(), 5));
    assert_eq!(flight.info["sys_name"], "StampFly");
    assert_eq!(flight.parameters["gain"], [(Instant::from_micros(500), 1.5), (Instant::from_micros(50_000), 2.5)]);
    assert_eq!((flight.events[0].at, flight.events[0].text.as_str()), (Instant::from_micros(20_000), "hello"));
}

#[test]
fn a_cut_off_log_gives_what_is_there_and_names_the_place() {
    let mut bytes = log();
    bytes.truncate(bytes.len() * 2 / 3);
    let log = flight_log::parse(&bytes).unwrap();
    let samples = log.flight.topics["estimate_state"].at.len();
    assert!((20..45).contains(&samples), "{samples}");
    let [Omission::Damage(error)] = log.omissions[..] else { panic!("{:?}", log.omissions) };
    assert_eq!(error.kind, ReadErrorKind::Truncated);
    assert!(error.offset < bytes.len() && error.offset + 300 > bytes.len());
    assert_eq!(log.end, End::Cut { at: error.offset, rest: bytes.len() - error.offset });
}

#[test]
fn errors_name_the_file() {
    let missing = flight_log::load("no/such/flight.ulg").unwrap_err();
    assert!(matches!(missing.kind, LogErrorKind::Io(_)));
    assert!(missing.to_string().starts_with("no/such/flight.ulg: "));
    let source = flight_log::load(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml")).unwrap_err();
    assert!(source.to_string().ends_with("Cargo.toml: not a ULog"), "{source}");
}

/// A log with one topic whose format and data are given.
fn foreign(format: &str, samples: &[&[u8]]) -> Vec<u8> {
    let mut log = Definitions::start(Bytes(Vec::new()), Instant::ZERO).unwrap().data(&[][..]).unwrap().into_sink().0;
    let mut message = |kind: u8, parts: &[&[u8]]| {
        let payload = parts.concat();
        log.extend((payload.len() as u16).to_le_bytes());
        log.push(kind);
        log.extend(payload);
    };
    message(b'F', &[format.as_bytes()]);
    message(b'A', &[&[2, 7, 0], b"esc"]);
    samples.iter().for_each(|sample| message(b'D', &[&[7, 0], sample]));
    message(b'D', &[&[9, 0], &[0; 8]]);
    log
}

#[test]
fn foreign_topics_are_taken_where_possible_and_listed_where_not() {
    let good = foreign(
        "esc:uint64_t timestamp;int16_t rpm;uint8_t[6] _padding0;",
        &[&[1, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff], &[2, 0, 0]],
    );
    let log = flight_log::parse(&good).unwrap();
    assert_eq!(log.flight.topics["esc[2]"].column("rpm"), Some(&[-1.0][..]), "trailing padding may be missing");
    assert_eq!(
        log.omissions,
        [Omission::ShortSamples { topic: "esc[2]".to_owned(), count: 1 }, Omission::UnknownData { id: 9, count: 1 },]
    );
    let unknown = flight_log::parse(&foreign("esc:uint64_t timestamp;report[4] r;", &[&[0; 40]])).unwrap();
    let reason = "type `report` is neither a basic one nor a format of the log".to_owned();
    assert_eq!(unknown.omissions[0], Omission::Topic { topic: "esc".to_owned(), reason });
    assert!(unknown.flight.topics.is_empty());
    let timeless = flight_log::parse(&foreign("esc:float value;", &[&[0; 4]])).unwrap();
    assert!(matches!(&timeless.omissions[0], Omission::Topic { reason, .. } if reason.contains("timestamp")));
}

#[test]
fn formats_within_formats_are_columns_as_pyulog_names_them() {
    let log = flight_log::parse(&px4_like()).unwrap();
    assert_eq!((log.end, &log.omissions[..]), (End::Whole, &[][..]));
    let names = |topic: &str| -> Vec<String> {
        log.flight.topics[topic].columns.iter().map(|column| column.name.clone()).collect()
    };
    let inner = ["timestamp", "lat", "yaw", "valid"];
    let expected = ["previous", "current"].iter().flat_map(|outer| inner.map(|inner| format!("{outer}.{inner}")));
    assert_eq!(names("position_setpoint_triplet"), expected.collect::<Vec<_>>());
    assert_eq!(names("esc_status")[4], "esc[0].esc_voltage[1]");
    let triplet = &log.flight.topics["position_setpoint_triplet"];
    assert_eq!(triplet.column("current.lat").unwrap(), (0..20).map(f64::from).collect::<Vec<_>>());
    let esc = &log.flight.topics["esc_status"];
    assert_eq!(esc.column("esc[3].esc_rpm").unwrap(), (300..320).map(f64::from).collect::<Vec<_>>());
    assert_eq!(esc.column("esc[2].esc_voltage[1]").unwrap()[5], 205.0);
    assert_eq!(esc.column("counter").unwrap()[19], 19.0);
}

#[test]
fn instances_and_topics_declared_twice_are_read() {
    let log = flight_log::parse(&px4_like()).unwrap();
    let [first, second] = ["sensor_accel", "sensor_accel[1]"].map(|name| &log.flight.topics[name]);
    assert_eq!((first.at.len(), second.at.len()), (20, 30));
    assert_eq!((first.column("x").unwrap()[19], second.column("x").unwrap()[29]), (21.0, 100.0));

    // Another format of the same name is a series of its own, and of the same name again the first.
    let mut other = begun(1);
    for (id, fields) in [(1, "float a;"), (2, "float b;"), (3, "float a;")] {
        format(&mut other, &format!("x:uint64_t timestamp;{fields}"));
        subscribe(&mut other, id, 0, "x");
        sample(&mut other, id, 10 * u64::from(id), &f32::from(id).to_le_bytes());
    }
    let topics = flight_log::parse(&other).unwrap().flight.topics;
    assert_eq!(topics["x"].column("a"), Some(&[1.0, 3.0][..]));
    assert_eq!(topics["x#2"].column("b"), Some(&[2.0][..]));
}

#[test]
fn a_stamp_of_zero_is_no_time() {
    let log = flight_log::parse(&px4_like()).unwrap();
    assert_eq!(log.flight.topics["position_setpoint_triplet"].at[0], Instant::ZERO, "the sample is kept");
    let start = Instant::from_secs(1_000);
    assert_eq!(log.flight.span(), Some((start, start + Duration::from_millis(195))));
}

#[test]
fn small_files_that_claim_much_cost_little() {
    for (what, bytes) in hostile() {
        let began = std::time::Instant::now();
        let log = flight_log::parse(&bytes).unwrap();
        let columns: usize = log.flight.topics.values().map(|series| series.columns.len()).sum();
        let took = began.elapsed();
        println!("{what}: {} bytes, {columns} columns, {} omissions, {took:?}", bytes.len(), log.omissions.len());
        assert!(took.as_secs_f64() < 2.0, "{what}: {took:?}");
        assert!(columns <= 1 << 16 && log.flight.topics.len() <= 4_096 && log.omissions.len() <= 101, "{what}");
    }
}

proptest! {
    #[test]
    fn damage_never_breaks_the_shape(damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..30)) {
        let mut bytes = log();
        for (index, byte) in damage {
            let index = index.index(bytes.len());
            bytes[index] = byte;
        }
        if let Ok(log) = flight_log::parse(&bytes) {
            for series in log.flight.topics.values() {
                prop_assert!(series.columns.iter().all(|column| column.values.len() == series.at.len()));
            }
        }
    }
}
