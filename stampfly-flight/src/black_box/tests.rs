//! What a black box keeps, of random traffic and of a flight.

use super::*;
use crate::newest::message;
use crate::rover::topics::{COUNT, Id, TOPICS};
use proptest::prelude::*;
use stampfly_types::messages::FlightStatus;
use stampfly_types::{Duration, Message};
use std::vec::Vec;

const RETENTION: Retention = Retention {
    topics: &TOPICS,
    rate: |topic| if topic == Id::flight_status as usize { LogRate::OnChange } else { LogRate::EverySample },
    armed: |topic, words| {
        let mode = (topic == Id::flight_status as usize).then(|| message::<FlightStatus>(words));
        mode.map(|mode| mode.is_some_and(|mode| mode.armed))
    },
};
const RANGE: usize = Id::sensor_range as usize;
const MODE: usize = Id::flight_status as usize;

type Small = BlackBox<257, COUNT>;

fn mode(armed: bool) -> impl AsRef<[u32]> {
    FlightStatus { armed, ..Default::default() }.to_words()
}

fn arm<const WORDS: usize>(black_box: &mut BlackBox<WORDS, COUNT>, at: Instant) {
    black_box.note(MODE, at, 1, mode(true).as_ref());
}

proptest! {
    /// What is recorded is the newest, in order and unchanged, and no memory is left unused.
    #[test]
    fn the_newest_is_kept(
        start in any::<u32>().prop_map(|start| Instant::from_micros(u64::from(start) << 8)),
        picks in prop::collection::vec((0..2usize, 0u64..1_000, any::<u32>()), 1..200),
    ) {
        let mut black_box = Small::new(RETENTION);
        arm(&mut black_box, start);
        let mut all = std::vec![(MODE, start, 1, mode(true).as_ref().to_vec())];
        let mut at = start;
        for (topic, later, seed) in picks {
            at += Duration::from_micros(later);
            let words: Vec<u32> = (0..TOPICS[topic].words as u32).map(|index| seed.wrapping_add(index)).collect();
            black_box.note(topic, at, seed, &words);
            all.push((topic, at, seed & 0xFF_FFFF, words));
        }
        let kept: Vec<_> =
            black_box.records().map(|r| (r.topic, r.at, r.generation, r.words.to_vec())).collect();
        prop_assert!(!kept.is_empty());
        prop_assert_eq!(&kept[..], &all[all.len() - kept.len()..]);
        let size: usize = kept.iter().map(|(.., words)| HEAD + words.len()).sum();
        if let Some((.., words)) = all.len().checked_sub(kept.len() + 1).and_then(|gone| all.get(gone)) {
            // The one that went last had to go for a later one, the longest at most.
            prop_assert!(size + HEAD + words.len() + HEAD + longest_message(&TOPICS) > 257, "{} used", size);
        }
    }
}

#[test]
fn a_recording_begins_when_the_vehicle_is_armed_and_ends_a_tail_after() {
    let mut black_box = Small::new(RETENTION);
    let sample = |black_box: &mut Small, millis| black_box.note(RANGE, Instant::from_millis(millis), 0, &[0; 4]);
    let samples = |black_box: &Small| {
        let samples = black_box.records().filter(|record| record.topic == RANGE);
        samples.map(|record| record.at.as_micros() / 1_000).collect::<Vec<_>>()
    };
    sample(&mut black_box, 1);
    assert_eq!(black_box.records().count(), 0, "disarmed");
    arm(&mut black_box, Instant::from_millis(10));
    sample(&mut black_box, 11);
    black_box.note(RANGE, Instant::from_millis(12), 0, &[0; 3]);
    black_box.note(COUNT, Instant::from_millis(12), 0, &[0; 4]);
    black_box.note(MODE, Instant::from_millis(100), 2, mode(false).as_ref());
    sample(&mut black_box, 259);
    sample(&mut black_box, 260);
    assert_eq!(samples(&black_box), [11, 259]);
    let mut cursor = black_box.begin();
    assert!(black_box.next(&mut cursor).is_ok_and(|record| record.is_some()));
    arm(&mut black_box, Instant::from_millis(500));
    assert_eq!(samples(&black_box), [], "the next flight");
    assert_eq!(black_box.next(&mut cursor), Err(Changed));
}

#[test]
fn states_are_kept_on_change_and_once_a_second() {
    let mut black_box = BlackBox::<1024, COUNT>::new(RETENTION);
    let mut note = |millis: u32, transitions| {
        let mode = FlightStatus { armed: true, transitions, ..Default::default() };
        black_box.note(MODE, Instant::from_millis(millis.into()), millis, &mode.to_words());
        black_box.records().map(|record| record.generation).collect::<Vec<_>>()
    };
    (0..2_999).for_each(|millis| drop(note(millis, millis / 1_500)));
    assert_eq!(note(2_999, 1), [0, 1_000, 1_500, 2_500]);
    // One that changes all the time is kept fifty times a second.
    (3_000..3_999).for_each(|millis| drop(note(millis, millis)));
    assert_eq!(note(3_999, 3_999).len(), 4 + 50);
}

#[test]
fn a_rate_is_kept_on_average() {
    let retention = Retention { rate: |_| LogRate::hertz(25), ..RETENTION };
    let mut black_box = BlackBox::<1024, COUNT>::new(retention);
    // Every 15 ms: 40 ms are no multiple.
    for at in (0..3_000).step_by(15).map(Instant::from_millis) {
        arm(&mut black_box, at);
        black_box.note(RANGE, at, 0, &[0; 4]);
    }
    let kept: Vec<_> = black_box.records().filter(|record| record.topic == RANGE).map(|record| record.at).collect();
    let span = kept.last().expect("kept").since(kept[0]);
    assert!((span.as_millis() / (kept.len() as u64 - 1)).abs_diff(40) <= 1, "{} in {span}", kept.len());
    assert_eq!(LogRate::hertz(0), LogRate::Never);
}
