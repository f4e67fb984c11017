//! Logs that are cut off or damaged: the reader returns the part that is whole, or an error that says
//! what is wrong. It never panics, and its time and memory are bounded.

use crate::damage::{cuts, flips, measured};
use crate::flight_log;
use crate::foreign_log::px4_like;
use stampfly_host::flight::Series;
use stampfly_host::flight_log::parse;
use stampfly_log::ulog::{End, ReadErrorKind};
use std::time::{Duration, Instant};

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
    measured("damaged_logs::logs", read_logs);
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
