//! Recordings of every kind that are cut off or damaged: the reader returns the part that is whole, or
//! an error that says what is wrong. It never panics, and its time and memory are bounded.

use crate::damage::{cuts, flips, measured};
use crate::hostile_recordings::recordings;
use stampfly_lab::dataset;
use std::time::{Duration, Instant};

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
