//! Recording and replay on a robot whose planner publishes on a queue that is too short: refusals, gaps, key frames.

use core::convert::Infallible;
use proptest::prelude::*;
use serde::{Deserialize, Serialize};
use stampfly_bus::{Activation, Band, Duration, Instant, Runnable, Taps, message};
use stampfly_flight::{Assembled, LogSchema, Recorder, Replay, ReplayError, ReplayOptions, key_frame, replay::replay};
use stampfly_log::ulog::{Definitions, Sink};

message! {
    /// A distance.
    pub struct Range {
        /// To the wall.
        distance: f32 ["m"],
    }
}

message! {
    /// A step to take.
    pub struct Step {
        /// How far.
        length: f32 ["m"],
    }
}

mod topics {
    use super::{Range, Step};
    stampfly_bus::topics! {
        outside eye, wheel;

        /// What the eye sees.
        range: Range = ring(4) @ 100 Hz from eye => [planner];
        /// Steps to take. Short on purpose: the driver is slower than the planner.
        steps: Step = queue(2) @ on event from planner => [driver];
        /// Steps the planner could not get rid of.
        refused: Range = latest @ 100 Hz from planner => [];
        /// Where the robot is.
        place: Range = latest @ 20 Hz from driver => [wheel, planner];
    }
}

/// Plans a step for every range, and adds up what was refused.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Planner {
    refused: f32,
}

impl Planner {
    fn new(_: &f32) -> Self {
        Self::default()
    }
}

impl Runnable for Planner {
    type Ends<'b> = topics::PlannerEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut Self::Ends<'_>) {
        for range in ends.range.iter() {
            let length = (range.data.distance - ends.place.get().distance) / 3.0;
            if let Err(stampfly_bus::Full(step)) = activation.offer(&mut ends.steps, Step { length }) {
                self.refused += step.length;
            }
        }
        ends.refused.publish(activation.now(), &Range { distance: self.refused });
    }
}

/// Takes the steps.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Driver {
    gain: f32,
    place: f32,
}

impl Driver {
    fn new(gain: &f32) -> Self {
        Self { gain: *gain, place: 0.0 }
    }
}

impl Runnable for Driver {
    type Ends<'b> = topics::DriverEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut Self::Ends<'_>) {
        self.place += ends.steps.iter().map(|step| step.data.length * self.gain).sum::<f32>();
        ends.place.publish(activation.now(), &Range { distance: self.place });
    }
}

stampfly_bus::schedule! {
    /// The robot.
    #[derive(Clone, Debug, Serialize, Deserialize)]
    pub struct Robot on topics from f32;

    /// Plans.
    planner = Planner: on range, flight, 10 us;
    /// Drives.
    driver = Driver: every 50 ms, background, 10 us;
}

const GAIN: f32 = 0.5;

/// A log in memory that refuses to write while it is told to.
#[derive(Default)]
struct Disk {
    bytes: Vec<u8>,
    full: std::rc::Rc<core::cell::Cell<bool>>,
}

impl Sink for Disk {
    type Error = ();
    fn write(&mut self, bytes: &[u8]) -> Result<(), ()> {
        if self.full.get() {
            return Err(());
        }
        self.bytes.extend_from_slice(bytes);
        Ok(())
    }
}

/// Drives for these many ranges, 10 ms apart. The disk is full during `outage`; key frames come every 200 ms.
fn record(ranges: &[f32], outage: core::ops::Range<usize>) -> Vec<u8> {
    let mut bus = topics::Bus::new();
    let Assembled { mut flight_loop, mut outside, mut taps } =
        Assembled::<Robot>::new(&mut bus, None, &GAIN, Instant::ZERO);
    let disk = Disk::default();
    let full = disk.full.clone();
    let mut head = Definitions::start(disk, Instant::ZERO).expect("room");
    head.info("sys_name", "robot").expect("room");
    let mut recorder = Recorder::<Robot, _>::new(head.data(LogSchema::new(&[])).expect("room"));
    for (place, distance) in ranges.iter().enumerate() {
        full.set(outage.contains(&place));
        let now = Instant::from_millis(10 * place as u64 + 10);
        outside.eye.range.publish(now, &Range { distance: *distance });
        taps.drain(&mut |topic, at, generation, words| recorder.sample(topic, at, generation, words));
        for band in [Band::Flight, Band::Background] {
            flight_loop.run_band(band, now, &mut recorder);
        }
        taps.drain(&mut |topic, at, generation, words| recorder.sample(topic, at, generation, words));
        if place % 20 == 19 {
            let mut frame = [0; 4096];
            let length = key_frame::encode(&flight_loop, now, &mut frame).expect("room");
            let _ = recorder.key_frame(now, &frame[..length]);
        }
    }
    recorder.into_sink().bytes
}

fn again(log: &[u8], options: ReplayOptions) -> Result<Replay, ReplayError> {
    replay::<Robot>(log, GAIN, |_, _, _| true, options)
}

fn ranges(count: usize) -> Vec<f32> {
    (0..count).map(|k| 1.0 + (k % 7) as f32 * 0.3).collect()
}

#[test]
fn a_publisher_that_is_refused_replays_bit_for_bit() {
    let log = record(&ranges(200), 0..0);
    let outcome = again(&log, ReplayOptions::default()).expect("replays");
    assert_eq!(outcome.difference, None);
    assert!(outcome.activations > 230 && outcome.key_frames == 10, "{outcome:?}");
    // Something was refused, or this proves nothing.
    let text = String::from_utf8_lossy(&log);
    assert!(text.contains("refused"), "the topic is there");
    let refused = stampfly_log::ulog::Reader::new(&log).expect("a log").filter(|message| {
        matches!(message, Ok(stampfly_log::ulog::Message::Data { payload, .. })
            if payload.len() == 16 + 12 && payload[12..16] != [0; 4])
    });
    assert!(refused.count() > 50, "a queue of two is full most of the time");
}

#[test]
fn a_wrong_gain_is_found() {
    let log = record(&ranges(50), 0..0);
    let outcome = replay::<Robot>(&log, 0.4, |_, _, _| true, ReplayOptions::default()).expect("replays");
    let difference = outcome.difference.expect("another gain, another place");
    assert_eq!((difference.activation.as_str(), difference.topic.as_str()), ("driver", "place"));
}

#[test]
fn a_replay_starts_in_the_middle() {
    let log = record(&ranges(200), 0..0);
    let from = Some(Instant::from_millis(1_000));
    let outcome = again(&log, ReplayOptions { from, ..Default::default() }).expect("replays");
    assert_eq!((&outcome.difference, outcome.gaps), (&None, 0));
    assert!(outcome.skipped > 100 && outcome.activations > 100 && outcome.activations < 150);
    let from = Some(Instant::from_secs(60));
    assert_eq!(again(&log, ReplayOptions { from, ..Default::default() }), Err(ReplayError::NoKeyFrame));
}

#[test]
fn a_replay_goes_on_after_a_loss() {
    let log = record(&ranges(200), 47..52);
    let outcome = again(&log, ReplayOptions::default()).expect("replays");
    assert_eq!((&outcome.difference, outcome.gaps), (&None, 1));
    assert!(outcome.skipped > 0 && outcome.activations > 200, "{outcome:?}");
    let log = record(&ranges(60), 57..59);
    let error = again(&log, ReplayOptions::default()).map(|outcome| outcome.gaps);
    assert!(matches!(error, Ok(0..=1) | Err(ReplayError::Dropout { .. } | ReplayError::Gap { .. })), "{error:?}");
}

#[test]
fn another_robots_key_frame_is_refused() {
    let mut bus = topics::Bus::new();
    let Assembled { flight_loop, .. } = Assembled::<Robot>::new(&mut bus, None, &GAIN, Instant::ZERO);
    let mut frame = [0; 4096];
    let length = key_frame::encode(&flight_loop, Instant::from_millis(3), &mut frame).expect("room");
    assert_eq!(key_frame::encode(&flight_loop, Instant::ZERO, &mut [0; 16]), Err(key_frame::KeyFrameError::NoRoom));
    let mut again = topics::Bus::new();
    let Assembled { mut flight_loop, mut outside, .. } =
        Assembled::<Robot>::new(&mut again, None, &GAIN, Instant::ZERO);
    let mut restore = |bytes: &[u8]| key_frame::restore(bytes, &mut flight_loop, &mut outside);
    assert_eq!(restore(&frame[..length]), Ok(Instant::from_millis(3)));
    for cut in 0..length {
        assert!(restore(&frame[..cut]).is_err(), "{cut}");
    }
    frame[9] ^= 1;
    assert_eq!(restore(&frame[..length]), Err(key_frame::KeyFrameError::OtherTables));
}

/// A sink that never fails.
struct Memory(Vec<u8>);

impl Sink for Memory {
    type Error = Infallible;
    fn write(&mut self, bytes: &[u8]) -> Result<(), Infallible> {
        self.0.extend_from_slice(bytes);
        Ok(())
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// Whatever the eye sees and whenever the disk is full: what can be replayed is identical.
    #[test]
    fn what_is_replayed_is_identical(
        ranges in prop::collection::vec(-10.0f32..10.0, 60..160),
        start in 0usize..150,
        length in 0usize..30,
    ) {
        let log = record(&ranges, start..start + length);
        match again(&log, ReplayOptions::default()) {
            Ok(outcome) => prop_assert_eq!(outcome.difference, None),
            // Nothing to go on from: the loss is behind the last key frame.
            Err(error) => prop_assert!(length > 0, "{}", error),
        }
    }
}

#[test]
fn time_is_an_argument() {
    let log = Definitions::start(Memory(Vec::new()), Instant::from_millis(5)).expect("memory");
    let log = log.data(LogSchema::<Robot>::new(&[])).expect("memory").into_sink().0;
    assert_eq!(again(&log, ReplayOptions::default()), Err(ReplayError::NoActivations));
    assert_eq!(Duration::from_millis(5).as_micros(), 5_000);
}
