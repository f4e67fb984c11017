//! Every kind of file that is read, cut off at a thousand places and with bytes turned over: the
//! whole part is read, or an error says what is wrong. Never a panic, never long, and never much
//! memory: each test runs in a process of its own, whose peak is measured.

use crate::flight_log;
use crate::foreign_log::px4_like;
use crate::hostile_recordings::recordings;
use stampfly_lab::dataset;
use stampfly_lab::flight::Series;
use stampfly_lab::flight_log::parse;
use stampfly_log::ulog::{End, ReadErrorKind};
use std::process::Command;
use std::time::{Duration, Instant};

/// Cuts of a file.
const CUTS: usize = 1_000;
/// Bytes that are turned over: the first ones, and as many over the whole file.
const BYTES: usize = 200;
/// What reading a small file may take at most.
const PATIENCE: Duration = Duration::from_secs(2);
/// The most memory that a process may have had which reads all of them, MB.
const MEMORY: u64 = 200;
/// Set in a process that was started to be measured.
const MEASURED: &str = "STAMPFLY_MEASURED";

/// The most memory that this process has had, MB; `None` where the system does not say.
fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.split_whitespace().next()?.parse::<u64>().ok()?.div_ceil(1_000))
}

/// Runs a test in a process of its own, and measures there. `work` reads everything, and returns how
/// many files those were and the longest time that one took.
fn measured(test: &str, work: impl FnOnce() -> (usize, Duration)) {
    if std::env::var_os(MEASURED).is_none() {
        let program = std::env::current_exe().expect("this program");
        let run = Command::new(program).args(["--exact", test, "--nocapture"]).env(MEASURED, "1").output();
        let output = run.expect("it runs");
        let said = String::from_utf8_lossy(&output.stdout);
        println!("{}", said.lines().filter(|line| line.contains(" files")).collect::<Vec<_>>().join("\n"));
        let why = String::from_utf8_lossy(&output.stderr);
        return assert!(output.status.success() && said.contains("1 passed"), "{said}{why}");
    }
    let before = peak();
    let (files, longest) = work();
    let peak = peak();
    println!("{test}: {files} files, at most {longest:.1?} each, peak memory {peak:?} MB ({before:?} before)");
    assert!(longest < PATIENCE && peak.is_none_or(|peak| peak < MEMORY));
}

fn cuts(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    (0..CUTS).map(|cut| &bytes[..cut * bytes.len() / CUTS])
}

fn flips(bytes: &[u8]) -> impl Iterator<Item = Vec<u8>> {
    let first = 0..BYTES.min(bytes.len());
    let spread = (0..BYTES).map(|place| place * bytes.len() / BYTES);
    first.chain(spread).flat_map(|place| {
        [1, 0x80, 0xff].map(|bits| {
            let mut flipped = bytes.to_vec();
            flipped[place] ^= bits;
            flipped
        })
    })
}

/// Is this the beginning of the other, row by row?
fn begins(part: &Series, whole: &Series) -> bool {
    let columns = part.columns.iter().zip(&whole.columns);
    let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
    whole.at.starts_with(&part.at)
        && part.columns.len() == whole.columns.len()
        && columns.into_iter().all(|(part, whole)| bits(&whole.values).starts_with(&bits(&part.values)))
}

#[test]
fn logs() {
    measured("damaged_files::logs", read_logs);
}

fn read_logs() -> (usize, Duration) {
    let (mut files, mut longest) = (0, Duration::ZERO);
    let mut took = |began: Instant| {
        files += 1;
        longest = longest.max(began.elapsed());
    };
    for (what, bytes) in [("ours", flight_log::log()), ("PX4's", px4_like())] {
        let whole = parse(&bytes).expect("a log").flight;
        for part in cuts(&bytes) {
            let began = Instant::now();
            match parse(part) {
                Ok(log) => {
                    assert!(log.flight.topics.iter().all(|(name, part)| begins(part, &whole.topics[name])), "{what}");
                    match log.end {
                        End::Whole => {}
                        End::Cut { at, rest } => assert_eq!(at + rest, part.len(), "{what}"),
                        End::Damaged { .. } => panic!("{what}: {} of {} bytes: {}", part.len(), bytes.len(), log.end),
                    }
                }
                Err(error) => assert_eq!((error.kind, part.len() < 16), (ReadErrorKind::NotULog, true), "{what}"),
            }
            took(began);
        }
        for flipped in flips(&bytes) {
            let began = Instant::now();
            if let Ok(log) = parse(&flipped) {
                let series = log.flight.topics.values();
                assert!(
                    series.flat_map(|s| s.columns.iter().map(|c| (c, s.at.len()))).all(|(c, n)| c.values.len() == n)
                );
            }
            took(began);
        }
    }
    (files, longest)
}

#[test]
fn recordings_of_all_kinds() {
    measured("damaged_files::recordings_of_all_kinds", read_recordings);
}

fn read_recordings() -> (usize, Duration) {
    let (mut files, mut longest) = (0, Duration::ZERO);
    for (what, bytes) in recordings() {
        assert!(dataset::parse(what, &bytes).is_ok(), "{what}");
        for damaged in cuts(&bytes).map(<[u8]>::to_vec).chain(flips(&bytes)) {
            let began = Instant::now();
            match dataset::parse(what, &damaged) {
                Ok(recording) => assert!(recording.imu.windows(2).all(|pair| pair[0].at < pair[1].at), "{what}"),
                Err(error) => assert!((1..2_000).contains(&error.to_string().len()), "{what}: {error}"),
            }
            files += 1;
            longest = longest.max(began.elapsed());
        }
    }
    (files, longest)
}
