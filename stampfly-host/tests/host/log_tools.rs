//! Logs of flights in the tools' hands: a part replays, tables and MCAP hold what the log holds.

use crate::flown::{HOP, Hop, hop};
use crate::foreign_log::{message, px4_like};
use crate::replay::replay;
use serde_json::Value;
use stampfly_host::flight_log;
use stampfly_host::log::{csv, cut, info::Info, mcap};
use stampfly_log::ulog::End;
use stampfly_types::Instant;
use std::io::Cursor;

#[test]
fn a_part_of_a_flight_replays_bit_for_bit() {
    let whole = &Hop::fly(&hop(3, None)).log;
    let length = Info::of(&flight_log::parse(whole).expect("a log")).last_s;
    for (from, to) in [(0.0, 4.0), (4.0, 9.5), (length - 3.0, length + 10.0)] {
        let instant = |seconds: f64| Instant::from_micros((seconds * 1e6) as u64);
        let (part, end) = cut::cut(whole, instant(from), instant(to)).expect("a log");
        assert_eq!(end, End::Whole);
        assert!(part.len() < whole.len() * 2 / 3, "{from} to {to}");
        let again = replay(&part).expect("a log of ours");
        assert_eq!(again.difference, None, "{from} to {to}");
        let seconds = to.min(length) - from;
        assert!(again.activations as f64 > 2_000.0 * (seconds - 1.5), "{from} to {to}: {}", again.activations);
        let info = Info::of(&flight_log::parse(&part).expect("a log"));
        assert!(info.first_s >= from && info.last_s <= to, "{info}");
        assert_eq!(info.gaps, usize::from(from > 0.0));
    }
    assert_eq!(
        cut::cut(whole, Instant::ZERO, Instant::from_secs(1_000)),
        Ok((whole.clone(), End::Whole)),
        "everything is the log itself"
    );
}

#[test]
fn of_a_damaged_log_the_whole_is_cut_and_replays() {
    let log = &HOP.log;
    let middle = log.len() / 2;
    let damaged = [&log[..middle], &log[middle + 3..]].concat();
    let (part, end) = cut::cut(&damaged, Instant::ZERO, Instant::from_secs(1_000)).expect("a log");
    assert!(matches!(end, End::Damaged { .. }), "{end}");
    let info = Info::of(&flight_log::parse(&part).expect("a log"));
    assert!(info.whole && info.gaps >= 1, "the part is whole, and marked where something is missing: {info}");
    let again = replay(&part).expect("a log of ours");
    assert!(again.difference.is_none() && again.gaps >= 1, "{again:?}");

    let (part, end) = cut::cut(&log[..middle], Instant::ZERO, Instant::from_secs(5)).expect("a log");
    let whole = cut::cut(log, Instant::ZERO, Instant::from_secs(5)).expect("a log");
    assert_eq!(part, whole.0, "what is cut off lies behind");
    assert!(matches!(end, End::Cut { .. } | End::Whole), "{end}");
    assert!(cut::cut(b"no log", Instant::ZERO, Instant::from_secs(1)).is_err());
}

/// Places of appended parts are of the log, not of a part of it.
#[test]
fn a_part_of_a_log_with_appended_data_is_a_log() {
    let mut log = px4_like();
    let behind = log.len();
    message(&mut log, b'P', &[&[9], b"float x_y", &1.0_f32.to_le_bytes()]);
    // Header of the file and of the message, compatible features; incompatible ones, then places.
    log[16 + 3 + 8] = 1;
    log[16 + 3 + 16..][..8].copy_from_slice(&(behind as u64).to_le_bytes());
    let (part, _) = cut::cut(&log, Instant::from_micros(1_000_100_000), Instant::from_secs(2_000)).expect("a log");
    let log = flight_log::parse(&part).expect("a log");
    assert_eq!((log.end, log.flight.parameters.len()), (End::Whole, 2));
    assert_eq!(log.flight.topics["esc_status"].at.len(), 10);
}

#[test]
fn what_has_no_time_does_not_say_when_a_log_begins() {
    let log = flight_log::parse(&px4_like()).expect("a log");
    let info = Info::of(&log);
    assert!((info.first_s - 1_000.0).abs() < 1e-9 && (info.last_s - 1_000.195).abs() < 1e-9, "{info}");
    let triplet = &info.topics["position_setpoint_triplet"];
    assert!((triplet.rate_hz.expect("two samples") - 100.0).abs() < 1e-6 && triplet.longest_gap_s < 0.011, "{info}");

    let mut file = Cursor::new(Vec::new());
    mcap::write(&log.flight, |_| true, &mut file).expect("memory");
    let bytes = file.into_inner();
    let messages: Vec<_> = ::mcap::MessageStream::new(&bytes).expect("an MCAP").map(|m| m.expect("whole")).collect();
    assert_eq!(messages.len(), 20 + 20 + 20 + 30);
    assert_eq!(messages.iter().map(|message| message.log_time).min(), Some(1_000_000_000_000));
    let triplet = messages.iter().rfind(|message| message.channel.topic == "position_setpoint_triplet");
    let sample: Value = serde_json::from_slice(&triplet.expect("a message").data).expect("JSON");
    assert_eq!((sample["current.lat"].as_f64(), sample["previous.valid"].as_f64()), (Some(19.0), Some(1.0)));
}

#[test]
fn tables_and_mcap_hold_what_the_log_holds() {
    let log = flight_log::parse(&HOP.log).expect("a log");
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

mod again {
    use super::{HOP, Instant};
    use stampfly_board::simulation::StampFly;
    use stampfly_host::flight::Series;
    use stampfly_host::flight_log;
    use stampfly_host::flown::fly;
    use stampfly_host::log::refly::{Reflown, ReflyError, facts, refly};
    use stampfly_sim::recorder::Recorder;
    use stampfly_sim::vehicle::change::ChangeError;
    use stampfly_sim::vehicle::{Options, Vehicle, Verdict};
    use stampfly_types::Duration;
    use std::sync::LazyLock;

    const FROM: Instant = Instant::from_millis(9_000);

    /// As `stampfly fly` writes it.
    fn log_of(options: &Options) -> Vec<u8> {
        let setup = StampFly::setup(options, 3).expect("options");
        let mut recorder = Recorder::<StampFly>::with_log(&setup, &facts::<StampFly>(options, 3).expect("options"));
        let outcome = fly::<StampFly>(&setup, &mut recorder, &mut |_, _| {}).outcome;
        assert!(outcome.succeeded());
        recorder.log().to_vec()
    }

    fn options() -> Options {
        let mission = Some("arm; takeoff 0.5; hover 2; goto 1 0 0.7; land".into());
        Options { mission, param: vec!["eskf.gate=4.5".into()], gust: Some(0.2), ..Options::default() }
    }

    /// The flight that is flown again, with other parameters.
    static LOG: LazyLock<Vec<u8>> = LazyLock::new(|| log_of(&options()));

    fn again(log: &[u8], parameter: &str) -> Result<Reflown<<StampFly as Vehicle>::Outcome>, ReflyError> {
        refly::<StampFly>(log, FROM, &[parameter.to_owned()])
    }

    #[test]
    fn the_same_value_is_the_recorded_flight_bit_for_bit() {
        for options in [options(), Options { fault: vec!["tof-stuck@move".into()], ..options() }] {
            let setup = StampFly::setup(&options, 3).expect("options");
            let mut recorder =
                Recorder::<StampFly>::with_log(&setup, &facts::<StampFly>(&options, 3).expect("options"));
            fly::<StampFly>(&setup, &mut recorder, &mut |_, _| {});
            let same = StampFly::parameters(StampFly::config(&setup));
            let same = same.iter().find(|setting| setting.name == "position.pos.kp").expect("a parameter").value as f32;
            let reflown = again(recorder.log(), &format!("position.pos.kp={same}")).expect("flies");
            assert!(reflown.log == recorder.log(), "other bits");
            assert_eq!((reflown.apart.since_s, reflown.apart.farthest_m), (None, 0.0));
        }
    }

    #[test]
    fn another_value_changes_what_comes_after_and_nothing_before() {
        let log = &*LOG;
        let reflown = again(log, "position.pos.kp=0.1").expect("flies");
        assert!(
            reflown.changed_at >= FROM && reflown.changed_at < Instant::from_millis(9_010),
            "{}",
            reflown.changed_at
        );
        let [before, now] = [log, &reflown.log].map(|log| flight_log::parse(log).expect("a log").flight);
        let mut differing = 0;
        for (topic, old) in &before.topics {
            let new = &now.topics[topic];
            // A sample has the stamp of what made it due, which is a little before the moment of rest.
            let before = |at: &Instant| FROM.since(*at) > Duration::from_millis(5);
            let until = |series: &Series| series.at.partition_point(before);
            assert!(old.at[..until(old)] == new.at[..until(new)], "{topic}");
            for (old_column, new_column) in old.columns.iter().zip(&new.columns) {
                let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
                let rows = until(old);
                assert!(bits(&old_column.values[..rows]) == bits(&new_column.values[..rows]), "{topic}");
                differing += usize::from(bits(&old_column.values) != bits(&new_column.values));
            }
        }
        assert!(differing > 20, "{differing} columns");
        assert!(
            reflown.apart.since_s.is_some_and(|since| since > 9.0) && reflown.apart.farthest_m > 0.02,
            "{}",
            reflown
        );
        let page = std::env::temp_dir().join(format!("stampfly-refly-{}.html", std::process::id()));
        reflown.write_report::<StampFly>(&page).expect("written");
        let text = std::fs::read_to_string(&page).expect("a page");
        std::fs::remove_file(&page).expect("removed");
        assert!(text.contains("as it flew") && text.contains("position.pos.kp=0.1"));
    }

    #[test]
    fn what_cannot_be_flown_again_is_refused_with_the_reason() {
        let log = &*LOG;
        let refused = |parameter: &str| again(log, parameter).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(refused("position.tilt.max=0.7").contains("failsafe.tip.tilt"), "a combination that cannot fly");
        assert!(refused("position.tilt.max=7").contains("must be from"));
        for parameter in ["estimator.type=1", "controller.type=1"] {
            let Err(error) = again(log, parameter) else { panic!("{parameter} is another component") };
            assert!(matches!(error, ReflyError::Change(ChangeError::OtherComponents)), "{parameter}: {error}");
        }
        let from_start =
            refly::<StampFly>(log, Instant::ZERO, &["estimator.type=1".into()]).expect("any component may begin");
        assert!(from_start.log != *log && crate::replay::replay(&from_start.log).expect("a log").difference.is_none());
        let error = refly::<StampFly>(log, Instant::from_secs(1_000), &["eskf.gate=4".into()]).expect_err("over");
        assert!(matches!(error, ReflyError::Over), "{error}");
        let error = again(&HOP.log, "eskf.gate=4").expect_err("as a board's own log, it names no world");
        assert!(matches!(error, ReflyError::NoWorld) && error.to_string().contains("stampfly replay"), "{error}");
        let cut = again(&log[..log.len() - 1], "position.pos.kp=1").expect("a log that was cut off is flown again");
        assert!(!cut.end.is_whole() && cut.to_string().contains("the log is cut off at byte"), "{cut}");
        let mut other = log.clone();
        let place = other.windows(5).position(|bytes| bytes == b"seed3").expect("a fact") + 4;
        other[place] = b'4';
        let error = again(&other, "eskf.gate=4").err().map(|error| error.to_string()).unwrap_or_default();
        assert!(error.contains("not the recorded flight"), "{error}");
    }
}
