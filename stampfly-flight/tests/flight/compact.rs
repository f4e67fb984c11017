//! Compact records of a robot: refusals, samples that come in the middle of a pass, interruptions, losses, damage.

use core::cell::RefCell;
use proptest::prelude::*;
use serde::{Deserialize, Serialize};
use stampfly_bus::{Activation, Band, Duration, Instant, Runnable, message};
use stampfly_flight::compact::{self, Chunk, Compact, Contents, Kept, ReadError, Ring, Samples, Streamer, Watching};
use stampfly_flight::flight_loop::{Ended, Positions};
use stampfly_flight::{Assembled, LogSchema, Observer, Recorder, Replay, ReplayError, ReplayOptions, replay::replay};
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
        outside eye, ear, hand, nose, wheel;

        /// What the eye sees. Activates the planner.
        range: Range = ring(4) @ 100 Hz from eye => [planner];
        /// What the ear hears, from another core.
        sound: Range = ring(8) @ 100 Hz from ear => [planner, arm, driver];
        /// Where the hand is, from another core.
        touch: Range = latest @ 100 Hz from hand => [arm, driver];
        /// What the nose smells. Nobody reads it.
        smell: Range = ring(8) @ 100 Hz from nose => [];
        /// Steps to take. Short on purpose: the driver is slower than the planner.
        steps: Step = queue(2) @ on event from planner => [driver];
        /// Steps that leave the robot. Nobody takes them while the flight is run again.
        orders: Step = queue(2) @ on event from arm => [wheel];
        /// Steps the planner could not get rid of.
        refused: Range = latest @ 100 Hz from planner => [arm];
        /// Where the robot is.
        place: Range = latest @ 20 Hz from driver => [wheel, planner];
        /// What the arm does.
        reach: Range = latest @ 100 Hz from arm => [];
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
        self.refused += ends.sound.iter().map(|sound| sound.data.distance).sum::<f32>();
        for range in ends.range.iter() {
            let length = (range.data.distance - ends.place.get().distance) / 3.0;
            if let Err(stampfly_bus::Full(step)) = activation.offer(&mut ends.steps, Step { length }) {
                self.refused += step.length;
            }
        }
        ends.refused.publish(activation.now(), &Range { distance: self.refused });
    }
}

/// Reaches for what it feels.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Arm {
    sum: f32,
}

impl Arm {
    fn new(_: &f32) -> Self {
        Self::default()
    }
}

impl Runnable for Arm {
    type Ends<'b> = topics::ArmEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut Self::Ends<'_>) {
        self.sum = self.sum * 0.9 + ends.touch.get().distance + ends.refused.get().distance;
        self.sum += ends.sound.iter().map(|sound| sound.data.distance).sum::<f32>();
        self.sum += f32::from(u8::from(ends.touch.is_new()));
        if activation.offer(&mut ends.orders, Step { length: self.sum }).is_err() {
            self.sum += 1.0;
        }
        ends.reach.publish(activation.now(), &Range { distance: self.sum });
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
        self.place += ends.sound.iter().map(|sound| sound.data.distance).sum::<f32>() + ends.touch.get().distance;
        ends.place.publish(activation.now(), &Range { distance: self.place });
    }
}

stampfly_bus::schedule! {
    /// The robot.
    #[derive(Clone, Debug, Serialize, Deserialize)]
    pub struct Robot on topics from f32;

    /// Plans.
    planner = Planner: on range, flight, 10 us;
    /// Reaches.
    arm = Arm: after planner or at latest 15 ms, flight, 10 us;
    /// Drives.
    driver = Driver: every 50 ms, background, 10 us;
}

const GAIN: f32 = 0.5;
/// Words of the ring: three key frames, and what comes between them.
const WORDS: usize = 1024;
const KEPT: Kept<'_> = Kept {
    topics: &[topics::Id::refused as usize, topics::Id::place as usize, topics::Id::reach as usize],
    every: 3,
    key_frames: Duration::from_millis(200),
};

/// What happens in 10 ms.
#[derive(Clone, Copy, Debug)]
struct Turn {
    range: Option<f32>,
    /// Sounds and touches, and when: before a pass, or as soon as a line has read, or has run.
    sounds: [u8; 3],
    value: f32,
    /// The reader of the ring is away.
    is_away: bool,
    /// The background is interrupted for so many turns.
    interrupted: u8,
    /// The wheel takes orders.
    takes: bool,
    /// Nobody wants the record.
    is_unwanted: bool,
    /// A line that begins again at the end.
    renewed: Option<u8>,
}

fn turns(most: usize) -> impl Strategy<Value = Vec<Turn>> {
    let turn = (
        prop::option::weighted(0.9, -10.0f32..10.0),
        [0u8..12, 0u8..12, 0u8..12],
        -10.0f32..10.0,
        prop::bool::weighted(0.02),
        0u8..3,
        any::<bool>(),
    );
    let turn = turn.prop_map(|(range, sounds, value, is_away, interrupted, takes)| Turn {
        range,
        sounds,
        value,
        is_away,
        interrupted,
        takes,
        is_unwanted: false,
        renewed: None,
    });
    prop::collection::vec(turn, 30..most)
}

/// Another core, which publishes in the middle of a pass.
struct OtherCore<'b> {
    ear: topics::EarEnds<'b>,
    hand: topics::HandEnds<'b>,
    nose: topics::NoseEnds<'b>,
    now: Instant,
    turn: Option<Turn>,
    published: u32,
}

impl OtherCore<'_> {
    fn publish(&mut self, moment: u8) {
        let Some(turn) = self.turn else { return };
        for (number, sound) in turn.sounds.into_iter().enumerate() {
            if sound == moment {
                let distance = turn.value + self.published as f32;
                self.published += 1;
                if number == 1 {
                    self.hand.touch.publish(self.now, &Range { distance });
                    self.nose.smell.publish(self.now, &Range { distance });
                } else {
                    self.ear.sound.publish(self.now, &Range { distance });
                }
            }
        }
    }
}

impl Observer for OtherCore<'_> {
    fn starts(&mut self, index: usize) {
        self.publish(1 + index as u8);
    }

    fn has_read(&mut self, activation: &Activation) {
        self.publish(4 + activation.record().index);
    }

    fn finished(&mut self, activation: &Activation) {
        self.publish(7 + activation.record().index);
    }

    fn pass_ends(&mut self, _: Band, _: Ended, _: &mut dyn Positions) {
        self.publish(10);
    }
}

/// Flies for so many turns. Returns the record as a file, and the last state.
fn record(turns: &[Turn]) -> (Vec<u8>, u32, String) {
    let mut bus = topics::Bus::new();
    let Assembled { mut flight_loop, outside, .. } = Assembled::<Robot>::new(&mut bus, None, &GAIN, Instant::ZERO);
    let topics::Outside { mut eye, ear, hand, nose, mut wheel } = outside;
    let mut ring = Ring::<WORDS>::new();
    let (writer, reader) = ring.split();
    let mut streamer = Streamer::new(reader);
    let record = RefCell::new(Compact::<Robot, WORDS>::new(writer, flight_loop.heads(), "robot", KEPT));
    let mut other = OtherCore { ear, hand, nose, now: Instant::ZERO, turn: None, published: 0 };
    let mut file = compact::MAGIC.to_vec();
    let mut room = [0; 100];
    let mut pending: Option<(stampfly_flight::Pending, u8)> = None;
    for (number, turn) in turns.iter().enumerate() {
        let now = Instant::from_micros(10_000 * number as u64 + 10_000 + u64::from(turn.sounds[0]));
        (other.now, other.turn) = (now, Some(*turn));
        if let Some(distance) = turn.range {
            eye.range.publish(now, &Range { distance });
        }
        other.publish(0);
        if turn.takes {
            while wheel.orders.next().is_some() {}
        }
        let mut observer = (Watching(&record), &mut other);
        flight_loop.run_band(Band::Flight, now, &mut observer);
        pending = match pending {
            Some((pending, 0)) => {
                flight_loop.finish(pending, &mut observer);
                None
            }
            Some((pending, left)) => Some((pending, left - 1)),
            None if turn.interrupted > 0 => flight_loop
                .start_next(Band::Background, now, &mut observer)
                .map(|pending| (pending, turn.interrupted - 1)),
            None => {
                flight_loop.run_next(Band::Background, now, &mut observer);
                None
            }
        };
        if pending.is_none() && record.borrow().wants_key_frame() {
            let _ = record.borrow_mut().key_frame(&flight_loop);
        }
        if pending.is_none()
            && let Some(line) = turn.renewed
        {
            flight_loop.renew(line.into(), &GAIN);
            Watching(&record).renewed();
        }
        streamer.want(!turn.is_unwanted);
        while !turn.is_away
            && let Some(length) = streamer.chunk(&mut room, 1)
        {
            file.extend((length as u16).to_le_bytes());
            file.extend(&room[..length]);
        }
    }
    while let Some(length) = streamer.chunk(&mut room, 1) {
        file.extend((length as u16).to_le_bytes());
        file.extend(&room[..length]);
    }
    let lost = record.borrow().lost();
    (file, lost, format!("{:?}", flight_loop.runnables()))
}

struct Memory(Vec<u8>);

impl Sink for Memory {
    type Error = core::convert::Infallible;
    fn write(&mut self, bytes: &[u8]) -> Result<(), Self::Error> {
        self.0.extend_from_slice(bytes);
        Ok(())
    }
}

fn as_log(file: &[u8], samples: Samples) -> Result<(Vec<u8>, Contents), ReadError> {
    let head = Definitions::start(Memory(Vec::new()), Instant::ZERO).expect("room");
    let mut log = Recorder::<Robot, _>::new(head.data(LogSchema::new(&[])).expect("room"));
    let contents = compact::read(file, &GAIN, samples, &mut log)?;
    Ok((log.into_sink().0, contents))
}

fn again(log: &[u8]) -> Result<Replay, ReplayError> {
    let options = ReplayOptions { from: Some(Instant::ZERO), is_thinned: true };
    replay::<Robot>(log, GAIN, |_, _, _| true, options)
}

#[test]
fn a_line_that_begins_again_is_one_gap_and_an_unwanted_record_is_none() {
    let mut turns = calm(200);
    // Where nothing is interrupted.
    turns[85..95].iter_mut().for_each(|turn| turn.interrupted = 0);
    turns[94].renewed = Some(Id::driver as u8);
    let (file, lost, state) = record(&turns);
    let (_, contents) = as_log(&file, Samples::Recorded).expect("reads");
    assert_eq!((contents.gaps, lost > 0), (1, true));
    turns[94].renewed = None;
    assert_ne!(state, record(&turns).2, "it forgot something");
    turns.iter_mut().for_each(|turn| turn.is_unwanted = true);
    let (file, ..) = record(&turns);
    assert!(file.len() < 2_000, "{} bytes, of the passes before somebody looked", file.len());
}

fn calm(count: usize) -> Vec<Turn> {
    let turn = |number| Turn {
        range: Some((number * number % 37) as f32),
        sounds: [(number % 12) as u8, (number % 7) as u8, (number % 11) as u8],
        value: number as f32,
        is_away: false,
        interrupted: (number % 3) as u8,
        takes: number % 2 == 0,
        is_unwanted: false,
        renewed: None,
    };
    (0..count).map(turn).collect()
}

proptest! {
    /// Whatever comes and whenever, refusals and interruptions among it: every bit again, every activation, every key frame.
    #[test]
    fn a_record_replays_bit_for_bit(mut turns in turns(200)) {
        turns.iter_mut().for_each(|turn| turn.is_away = false);
        let (file, lost, _) = record(&turns);
        prop_assert_eq!(lost, 0);
        let (log, contents) = as_log(&file, Samples::Recorded).expect("reads");
        prop_assert_eq!((contents.gaps, contents.idle_since), (0, None));
        let outcome = again(&log).expect("replays");
        prop_assert_eq!(&outcome.difference, &None);
        prop_assert_eq!(outcome.activations, contents.activations);
        prop_assert!(outcome.activations as usize + 10 >= turns.len() && outcome.samples > 10, "{:?}", outcome);
    }

    /// Lines that begin again, and a record that is not always wanted: it goes on from a key frame each time, and every bit of what is in it is there again.
    #[test]
    fn what_begins_again_or_is_wanted_again_begins_with_a_key_frame(
        mut turns in turns(200),
        renewed in prop::collection::vec((0usize..200, 0u8..3), 1..5),
        unwanted in prop::collection::vec((0usize..200, 3usize..30), 0..3),
    ) {
        turns.iter_mut().for_each(|turn| turn.is_away = false);
        renewed.iter().for_each(|(at, line)| turns.iter_mut().skip(*at).take(1).for_each(|turn| turn.renewed = Some(*line)));
        unwanted.iter().for_each(|(at, count)| turns.iter_mut().skip(*at).take(*count).for_each(|turn| turn.is_unwanted = true));
        let (file, _, _) = record(&turns);
        if let Ok((log, contents)) = as_log(&file, Samples::Recorded) {
            prop_assert_eq!(contents.idle_since, None);
            let outcome = again(&log).expect("replays");
            prop_assert_eq!(&outcome.difference, &None);
            prop_assert_eq!(outcome.activations, contents.activations);
        } else {
            prop_assert!(!unwanted.is_empty(), "there is no key frame");
        }
    }

    /// A ring that nobody reads from for a while: what is missing is counted, and the rest replays.
    #[test]
    fn after_a_loss_a_record_goes_on_at_the_next_key_frame(mut turns in turns(300), away in 0usize..200, length in 0usize..100) {
        turns.iter_mut().for_each(|turn| turn.is_away = false);
        turns.iter_mut().skip(away).take(length).for_each(|turn| turn.is_away = true);
        let (file, lost, _) = record(&turns);
        let (log, contents) = as_log(&file, Samples::Recorded).expect("reads");
        prop_assert!(contents.gaps <= u64::from(lost) && (lost > 0 || contents.gaps == 0));
        let outcome = again(&log).expect("replays");
        prop_assert_eq!(&outcome.difference, &None);
        prop_assert_eq!(outcome.gaps, contents.gaps);
    }

    /// Chunks that the carrier loses: gaps, and no difference.
    #[test]
    fn a_carrier_may_lose_chunks(turns in turns(200), lost in prop::collection::vec(any::<prop::sample::Index>(), 1..4)) {
        let (file, _, _) = record(&turns);
        let mut chunks: Vec<&[u8]> = Vec::new();
        let mut rest = &file[compact::MAGIC.len()..];
        while let Some((length, behind)) = rest.split_first_chunk::<2>() {
            let (chunk, behind) = behind.split_at(u16::from_le_bytes(*length).into());
            chunks.push(chunk);
            rest = behind;
        }
        for index in lost {
            let place = index.index(chunks.len());
            chunks.remove(place);
        }
        let mut file = compact::MAGIC.to_vec();
        for chunk in chunks {
            file.extend((chunk.len() as u16).to_le_bytes());
            file.extend(chunk);
        }
        match as_log(&file, Samples::Recorded) {
            Ok((log, _)) => match again(&log) {
                Ok(outcome) => prop_assert_eq!(&outcome.difference, &None),
                Err(error) => prop_assert!(matches!(error, ReplayError::NoActivations), "{}", error),
            },
            Err(error) => prop_assert_eq!(error, ReadError::NoKeyFrame),
        }
    }

    /// Damage is an error or a gap, and never a panic.
    #[test]
    fn a_damaged_record_is_an_error_or_a_gap(place in any::<prop::sample::Index>(), bit in 0u8..8) {
        let (mut file, _, _) = record(&calm(40));
        let place = place.index(file.len());
        file[place] ^= 1 << bit;
        if let Ok((log, _)) = as_log(&file, Samples::Again) {
            let _ = again(&log);
        }
        file.truncate(place);
        let _ = as_log(&file, Samples::Recorded).map(|(log, _)| again(&log).is_ok());
    }
}

proptest! {
    /// Words that are others, in a chunk that is whole: an error, or another flight, and never a panic.
    #[test]
    fn other_words_are_an_error_or_another_flight(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u32>()), 1..4), shift in 0u32..32) {
        let (file, _, _) = record(&calm(40));
        let (_, chunk) = file[compact::MAGIC.len()..].split_first_chunk::<2>().expect("a chunk");
        let length = usize::from(u16::from_le_bytes([file[8], file[9]]));
        let mut words = Chunk::read(&chunk[..length]).expect("whole").words.to_vec();
        for rest in compact::File::new(&file).expect("a record").skip(1).flatten() {
            words.extend(rest.words);
        }
        for (place, value) in changes {
            let place = 4 * place.index(words.len() / 4);
            let old = u32::from_le_bytes(words[place..place + 4].try_into().expect("four"));
            words[place..place + 4].copy_from_slice(&(old ^ value >> shift).to_le_bytes());
        }
        let mut room = vec![0; words.len() + compact::OVERHEAD];
        let changed = Chunk { number: 0, begins: true, words: &words };
        let length = changed.write(&mut room).expect("room");
        prop_assert_eq!(Chunk::read(&room[..length]), Ok(changed));
        let mut file = compact::MAGIC.to_vec();
        file.extend((length as u16).to_le_bytes());
        file.extend(&room[..length]);
        if let Ok((log, _)) = as_log(&file, Samples::Recorded) {
            let _ = again(&log);
        }
    }
}

#[test]
fn a_record_runs_again_to_the_same_state() {
    let (file, lost, _) = record(&calm(100));
    assert_eq!((lost, compact::vehicle_name(&file)), (0, Some("robot")));
    let (thin, contents) = as_log(&file, Samples::Recorded).expect("reads");
    assert!(contents.key_frames >= 3 && contents.kept > 20, "{contents:?}");
    assert!(again(&thin).is_ok_and(|outcome| outcome.difference.is_none() && outcome.key_frames >= 3));
    let (log, _) = as_log(&file, Samples::Again).expect("reads");
    assert!(log.len() > thin.len(), "everything is in it");
    let outcome = again(&log).expect("replays");
    assert!(outcome.difference.is_none() && outcome.samples > 200, "{outcome:?}");
}

#[test]
fn a_value_that_is_changed_is_named() {
    let mut turns = calm(100);
    turns[50].range = Some(1234.5);
    let (file, ..) = record(&turns);
    let (mut log, _) = as_log(&file, Samples::Recorded).expect("reads");
    let place = log.windows(4).position(|bytes| bytes == 1234.5f32.to_le_bytes()).expect("it is there");
    log[place + 2] ^= 1;
    let difference = again(&log).expect("replays").difference.expect("it differs");
    assert!(difference.now > Instant::from_millis(500) && difference.field == "distance", "{difference}");
}

#[test]
fn what_is_no_record_is_refused() {
    assert!(matches!(as_log(b"", Samples::Recorded), Err(ReadError::File(_))));
    assert!(matches!(as_log(b"ULog\x01\x12\x35", Samples::Recorded), Err(ReadError::File(_))));
    assert_eq!(as_log(&compact::MAGIC, Samples::Recorded).map(|_| ()), Err(ReadError::NoKeyFrame));
    assert!(Chunk::read(&[]).is_err());
}
