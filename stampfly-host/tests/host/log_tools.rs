//! Logs of flights in the tools' hands: a part replays, tables and MCAP hold what the log holds.

use crate::replay::{record, replay, setup};
use serde_json::Value;
use stampfly_host::log::{csv, cut, info::Info, mcap};
use stampfly_lab::flight_log;
use stampfly_types::Instant;
use std::io::Cursor;

fn log() -> Vec<u8> {
    record(&setup(3, None))
}

#[test]
fn a_part_of_a_flight_replays_bit_for_bit() {
    let whole = log();
    let length = Info::of(&flight_log::parse(&whole).expect("a log")).last_s;
    for (from, to) in [(0.0, 4.0), (4.0, 9.5), (length - 3.0, length + 10.0)] {
        let instant = |seconds: f64| Instant::from_micros((seconds * 1e6) as u64);
        let part = cut::cut(&whole, instant(from), instant(to)).expect("a log");
        assert!(part.len() < whole.len() * 2 / 3, "{from} to {to}");
        let again = replay(&part).expect("a log of ours");
        assert_eq!(again.difference, None, "{from} to {to}");
        let seconds = to.min(length) - from;
        assert!(again.activations as f64 > 2_000.0 * (seconds - 1.5), "{from} to {to}: {}", again.activations);
        let info = Info::of(&flight_log::parse(&part).expect("a log"));
        assert!(info.first_s >= from && info.last_s <= to, "{info}");
        assert_eq!(info.gaps, usize::from(from > 0.0));
    }
    assert_eq!(cut::cut(&whole, Instant::ZERO, Instant::from_secs(1_000)), Ok(whole), "everything is the log itself");
}

#[test]
fn a_damaged_log_is_not_cut() {
    let mut damaged = log();
    let middle = damaged.len() / 2;
    damaged.drain(middle..middle + 3);
    assert!(cut::cut(&damaged, Instant::ZERO, Instant::from_secs(1_000)).is_err());
    assert!(cut::cut(b"no log", Instant::ZERO, Instant::from_secs(1)).is_err());
}

#[test]
fn tables_and_mcap_hold_what_the_log_holds() {
    let log = flight_log::parse(&log()).expect("a log");
    let series = &log.flight.topics["sensor_imu"];
    let mut table = Vec::new();
    csv::write(series, &mut table).expect("memory");
    let table = String::from_utf8(table).expect("text");
    assert_eq!(table.lines().count(), series.at.len() + 1);
    let place = series.columns.iter().position(|column| column.name == "gyro[1]").expect("a column");
    let row: Vec<&str> = table.lines().nth(1_000).expect("a row").split(',').collect();
    assert_eq!(row[0].parse(), Ok(series.at[999].as_micros()));
    assert_eq!(row[place + 1].parse::<f32>().map(f64::from), Ok(series.columns[place].values[999]));

    let mut file = Cursor::new(Vec::new());
    mcap::write(&log.flight, |name| name == "sensor_imu", &mut file).expect("memory");
    let bytes = file.into_inner();
    let messages: Vec<_> =
        ::mcap::MessageStream::new(&bytes).expect("an MCAP").map(|m| m.expect("a message")).collect();
    assert_eq!(messages.len(), series.at.len());
    assert_eq!(messages[999].log_time, 1_000 * series.at[999].as_micros());
    let sample: Value = serde_json::from_slice(&messages[999].data).expect("JSON");
    let value = sample["gyro"][1].as_f64().expect("a number") as f32;
    assert_eq!(f64::from(value), series.columns[place].values[999]);
}
