//! A golden drive of the rover.

use crate::common::topics::{Bus, Id, TOPICS};
use crate::common::{COUNT, Rover};
use proptest::prelude::*;
use stampfly_bus::{Activation, Band, PublishWords, Taps};
use stampfly_flight::golden::{GoldenError, PlayObserver, Report, Verdict, Writer, play, stack_size, tables};
use stampfly_flight::{Assembled, Observer};
use stampfly_log::FlightHash;
use stampfly_types::messages::{MotorOutput, TofData};
use stampfly_types::{Duration, Instant, Message};

const RANGE: usize = Id::sensor_range as usize;
const MOTORS: usize = Id::actuator_motor as usize;
const GAIN: f32 = 0.7;
const TOLERANCE: f32 = 0.01;

/// Half a second towards a wall, with a gap in the ranges and a burst longer than the topic's ring, as an executor of its own records it.
fn recorded() -> (Vec<u8>, FlightHash) {
    let start = Instant::from_secs(7);
    let mut bus = Bus::new();
    let Assembled { mut flight_loop, mut outside, mut taps } = Assembled::<Rover>::new(&mut bus, None, &GAIN, start);
    let (mut hash, mut motors, mut entries) = (FlightHash::new(), None, Vec::new());
    let mut writer = Writer::new(tables::<Rover>(), start, MOTORS, |piece: &[u8]| entries.extend_from_slice(piece));
    let mut drain = |motors: &mut Option<Vec<u32>>| {
        taps.drain(&mut |topic, at, generation, words| {
            hash.publish(topic as u16, generation, at, words);
            if topic == MOTORS {
                *motors = Some(words.to_vec());
            }
        });
    };
    for step in 0..50u64 {
        let clock = start + Duration::from_millis(10) * (step + 1);
        if step % 2 == 0 && !(20..40).contains(&step) {
            for later in 0..if step == 44 { 5 } else { 1 } {
                let at = clock - Duration::from_micros(300 - later);
                let range = TofData { distance: 1.4 - 0.02 * step as f32, valid: true, ..Default::default() };
                outside.publish_words(RANGE, at, &range.to_words()).expect("a range");
                writer.sample(RANGE, at, &range.to_words());
                drain(&mut motors);
            }
        }
        flight_loop.run_band(Band::Flight, clock, &mut ());
        flight_loop.run_band(Band::Background, clock, &mut ());
        writer.turn(clock);
        drain(&mut motors);
        if let Some(motors) = motors.take() {
            writer.output(&motors);
        }
    }
    let mut record = writer.header(hash.finish()).to_vec();
    record.append(&mut entries);
    (record, hash)
}

fn played(record: &[u8], gain: f32) -> Result<Report, GoldenError> {
    play::<Rover>(&mut Bus::new(), record, &gain, TOLERANCE, &mut ())
}

#[test]
fn the_same_machine_computes_the_same() {
    let (record, hash) = recorded();
    let report = played(&record, GAIN).expect("plays");
    assert_eq!((report.verdict, report.hash, report.messages), (Verdict::Identical, hash.finish(), hash.messages()));
    assert_eq!(report.duration, Duration::from_millis(500));
    assert!(stack_size::<Rover>() > size_of::<Bus>());
}

#[test]
fn rounding_is_told_from_nonsense() {
    let (record, _) = recorded();
    let slightly = played(&record, GAIN * 1.001).expect("plays").verdict;
    assert!(matches!(slightly, Verdict::WithinTolerance { worst } if worst > 0.0 && worst < 0.001), "{slightly:?}");
    // The largest duty is 0.98: one per cent of it is within the tolerance, one and a half are not.
    assert!(matches!(played(&record, GAIN * 1.01).expect("plays").verdict, Verdict::WithinTolerance { .. }));
    assert!(matches!(played(&record, GAIN * 1.015).expect("plays").verdict, Verdict::Beyond { .. }));
    let first = Instant::from_secs(7) + Duration::from_millis(10);
    let wrong = played(&record, 0.5).expect("plays").verdict;
    assert!(matches!(wrong, Verdict::Beyond { worst, since } if worst > 0.2 && since == first), "{wrong:?}");
    let infinite = played(&record, f32::NEG_INFINITY).expect("plays").verdict;
    assert!(matches!(infinite, Verdict::Beyond { worst: f32::INFINITY, .. }), "{infinite:?}");
}

#[test]
fn a_silent_vehicle_is_beyond() {
    let mut entries = Vec::new();
    let mut writer =
        Writer::new(tables::<Rover>(), Instant::ZERO, MOTORS, |piece: &[u8]| entries.extend_from_slice(piece));
    writer.output(&MotorOutput::default().to_words());
    let mut record = writer.header(0).to_vec();
    record.append(&mut entries);
    let verdict = played(&record, GAIN).expect("plays").verdict;
    assert_eq!(verdict, Verdict::Beyond { worst: f32::INFINITY, since: Instant::ZERO });
}

#[test]
fn another_record_is_refused() {
    let (record, _) = recorded();
    assert_eq!(played(b"ULog", GAIN), Err(GoldenError::NotGolden));
    assert_eq!(played(&record[..20], GAIN), Err(GoldenError::Damaged));
    assert_eq!(played(&record[..record.len() - 1], GAIN), Err(GoldenError::Damaged));
    let changed = |at: usize| {
        let mut record = record.clone();
        record[at] ^= 0x55;
        played(&record, GAIN)
    };
    assert_eq!(changed(8), Err(GoldenError::OtherTables));
    assert_eq!(changed(32), Err(GoldenError::Damaged), "no such output topic");
    assert_eq!(changed(40), Err(GoldenError::Damaged), "no such topic");
}

/// Counts what it is told.
#[derive(Default)]
struct Counts {
    bands: usize,
    published: [usize; 3],
    activations: [usize; COUNT],
}

impl Observer for Counts {
    fn finished(&mut self, activation: &Activation) {
        self.activations[usize::from(activation.record().index)] += 1;
    }
}

impl PlayObserver for Counts {
    fn band_finished(&mut self, _: Band) {
        self.bands += 1;
    }

    fn published(&mut self, topic: usize, _: Instant, _: u32, words: &[u32]) {
        assert_eq!(words.len(), TOPICS[topic].words);
        self.published[topic] += 1;
    }
}

#[test]
fn an_observer_is_told_everything() {
    let mut counts = Counts::default();
    let report = play::<Rover>(&mut Bus::new(), &recorded().0, &GAIN, TOLERANCE, &mut counts).expect("plays");
    assert_eq!(counts.bands, 100);
    assert_eq!(counts.published.iter().sum::<usize>() as u64, report.messages);
    // Fifteen times ranges, four more in the burst, and the deadline in the gap; the monitor once in 100 ms.
    assert_eq!(counts.activations, [15 + 4, 5]);
    assert_eq!(counts.published, [15 + 4, 15 + 4, 5]);
}

proptest! {
    #[test]
    fn no_bytes_panic(at: prop::sample::Index, value: u8) {
        let (mut record, _) = recorded();
        let at = at.index(record.len());
        record[at] = value;
        let _ = played(&record, GAIN);
    }
}
