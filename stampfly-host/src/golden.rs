//! Records the golden flight: a hop in simulation, as what came from outside and what the vehicle's output was.
//!
//! Two things are done to the flight before it is written. It ends when the motors have stood still for a moment. And
//! twice a second, where all other sensors' samples come closest together, they are held back by those few milliseconds
//! until they are new in one activation: by chance that happens once in minutes, and it is what a step costs most. Their
//! stamps stay, so the estimator sees late samples, as it does of a busy bus. The output is what this program computes
//! when it plays the record.

use crate::flown::fly;
use crate::recorder::Recorder;
use stampfly_bus::{Band, Schedule, TopicTable};
use stampfly_flight::Observer;
use stampfly_flight::golden::{GoldenError, PlayObserver, Report, Writer, play, tables};
pub use stampfly_sim::inputs::{Event, Inputs};
use stampfly_sim::vehicle::{Golden, Vehicle, Verdict};
use stampfly_types::{Duration, Instant};
use std::collections::BTreeMap;
use std::fmt;

/// A vehicle's bus.
type Topics<V> = <<V as Vehicle>::Runnables as Schedule>::Topics;

/// The record goes on for this long after the last change of state.
const TAIL: Duration = Duration::from_millis(100);
/// The output is written down so often.
const OUTPUT_PERIOD: Duration = Duration::from_millis(20);
/// Time between the activations in which every sensor has something new.
const GATHERING: Duration = Duration::from_millis(500);

/// Why no golden flight was recorded.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum RecordError {
    /// The vehicle did not do what it was asked for.
    Flight,
    /// What was recorded cannot be played.
    Golden(GoldenError),
}

impl fmt::Display for RecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Flight => f.write_str("the golden flight was not flown to its end"),
            Self::Golden(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for RecordError {}

impl From<GoldenError> for RecordError {
    fn from(error: GoldenError) -> Self {
        Self::Golden(error)
    }
}

/// Flies and records a vehicle's golden flight.
///
/// # Errors
/// When it was not flown to its end, or its record cannot be played.
pub fn record<V: Vehicle>(golden: &Golden<V>) -> Result<Vec<u8>, RecordError> {
    let mut recorder = Recorder::<V>::hash_only().with_inputs();
    let flown = fly::<V>(&golden.setup, &mut recorder, &mut |_, _| {});
    let end = (golden.settled)(&flown.outcome).filter(|_| flown.outcome.succeeded());
    let mut inputs = recorder.into_inputs();
    shorten(&mut inputs, end.ok_or(RecordError::Flight)? + TAIL);
    let start = V::options(&golden.setup).start;
    gather(&mut inputs, start, golden);
    Ok(write(golden, &inputs, start)?.0)
}

/// Leaves out what happened after `end`.
fn shorten(inputs: &mut Vec<Event>, end: Instant) {
    let late = |input: &Event| matches!(input, Event::Turn(clock) if *clock > end);
    if let Some(first) = inputs.iter().position(late) {
        inputs.truncate(first);
    }
}

/// Now and then, when the samples of all other sensors are youngest, holds them back until the leading sensor's next
/// sample comes.
fn gather<V: Vehicle>(inputs: &mut Vec<Event>, start: Instant, golden: &Golden<V>) {
    let others = other_sensors::<V>(inputs, golden.leading);
    let mut newest: Vec<Option<(Instant, usize)>> = vec![None; others.len()];
    // Of each stretch of time, the leading sample that the others are closest to: age of the oldest, and places.
    let mut closest: BTreeMap<u64, (Duration, usize, Vec<usize>)> = BTreeMap::new();
    for (place, input) in inputs.iter().enumerate() {
        let Event::Sample { topic, at, .. } = input else { continue };
        if *topic == golden.leading {
            let Some(seen) = newest.iter().copied().collect::<Option<Vec<_>>>() else { continue };
            // The last of them is slow and would decide alone: its age does not count.
            let ages = seen.iter().take(seen.len().saturating_sub(1)).map(|(seen, _)| at.since(*seen));
            let oldest = ages.max().unwrap_or_default();
            let stretch = at.since(start).as_micros() / GATHERING.as_micros();
            if closest.get(&stretch).is_none_or(|(best, ..)| *best > oldest) {
                closest.insert(stretch, (oldest, place, seen.into_iter().map(|(_, place)| place).collect()));
            }
        } else if let Some(sensor) = others.iter().position(|id| id == topic) {
            newest[sensor] = Some((*at, place));
        }
    }
    // From the back, so that the places in front stay.
    for (_, place, mut held) in closest.into_values().rev() {
        held.sort_unstable();
        let samples: Vec<Event> = held.iter().rev().map(|place| inputs.remove(*place)).collect();
        let place = place - held.len();
        inputs.splice(place..place, samples);
    }
}

/// The topics of the other sensors in a record, the slowest last.
fn other_sensors<V: Vehicle>(inputs: &[Event], leading: usize) -> Vec<usize> {
    let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
    for input in inputs {
        let Event::Sample { topic, .. } = input else { continue };
        let is_sensor =
            <Topics<V> as TopicTable>::TOPICS.get(*topic).is_some_and(|info| info.name.starts_with("sensor_"));
        if is_sensor && *topic != leading {
            *counts.entry(*topic).or_default() += 1;
        }
    }
    let mut topics: Vec<_> = counts.into_iter().collect();
    topics.sort_by_key(|(_, samples)| std::cmp::Reverse(*samples));
    topics.into_iter().map(|(topic, _)| topic).collect()
}

/// Writes a record of these inputs, with what comes of them here.
fn write<V: Vehicle>(golden: &Golden<V>, inputs: &[Event], start: Instant) -> Result<(Vec<u8>, Report), GoldenError> {
    // Played once without expecting anything, to find out what to expect.
    let (config, tolerance) = (V::config(&golden.setup), golden.tolerance);
    let mut outputs = Outputs { topic: golden.output, ..Outputs::default() };
    let blank = encode(golden, inputs, start, &[], 0);
    let first = play::<V::Runnables>(&mut TopicTable::new(), &blank, config, tolerance, &mut outputs)?;
    let record = encode(golden, inputs, start, &outputs.of_turns, first.hash);
    let report = play::<V::Runnables>(&mut TopicTable::new(), &record, config, tolerance, &mut ())?;
    Ok((record, report))
}

/// The bytes of a record: inputs, the output after each of its turns, and the hash.
fn encode<V: Vehicle>(
    golden: &Golden<V>,
    inputs: &[Event],
    start: Instant,
    outputs: &[Vec<u32>],
    hash: u64,
) -> Vec<u8> {
    let mut entries = Vec::new();
    let out = |bytes: &[u8]| entries.extend_from_slice(bytes);
    let mut writer = Writer::new(tables::<V::Runnables>(), start, golden.output, out);
    let (mut outputs, mut due) = (outputs.iter(), start);
    for input in inputs {
        match input {
            Event::Sample { topic, at, words } => writer.sample(*topic, *at, words),
            Event::Turn(clock) => {
                writer.turn(*clock);
                let output = outputs.next();
                if let Some(output) = output.filter(|output| *clock >= due && !output.is_empty()) {
                    due = *clock + OUTPUT_PERIOD;
                    writer.output(output);
                }
            }
        }
    }
    let mut record = writer.header(hash).to_vec();
    record.append(&mut entries);
    record
}

/// The newest sample of the output after each turn.
#[derive(Default)]
struct Outputs {
    topic: usize,
    now: Vec<u32>,
    of_turns: Vec<Vec<u32>>,
}

impl Observer for Outputs {}

impl PlayObserver for Outputs {
    fn published(&mut self, topic: usize, _: Instant, _: u32, words: &[u32]) {
        if topic == self.topic {
            self.now = words.to_vec();
            if let Some(last) = self.of_turns.last_mut() {
                last.clone_from(&self.now);
            }
        }
    }

    fn band_starts(&mut self, band: Band, _: Instant) {
        if band == Band::Flight {
            self.of_turns.push(self.now.clone());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use stampfly_board::golden::{FLIGHT, TOLERANCE};
    use stampfly_board::simulation::StampFly;
    use stampfly_board::topics::Id;
    use stampfly_board::{VehicleConfig, schedule::Runnables};
    use stampfly_bus::Activation;
    use stampfly_flight::golden::Verdict;
    use stampfly_types::{Message, messages::ImuData};

    fn golden() -> Golden<StampFly> {
        StampFly::golden().expect("it has one")
    }

    fn played(record: &[u8], observer: &mut impl PlayObserver) -> Result<Report, GoldenError> {
        play::<Runnables>(&mut TopicTable::new(), record, &VehicleConfig::default(), TOLERANCE, observer)
    }

    /// The golden flight as it was flown, with its hash.
    fn flown() -> (Vec<Event>, Instant, u64) {
        let golden = golden();
        let mut recorder = Recorder::<StampFly>::hash_only().with_inputs();
        let _ = fly::<StampFly>(&golden.setup, &mut recorder, &mut |_, _| {});
        let hash = recorder.hash();
        (recorder.into_inputs(), golden.setup.simulation.start, hash)
    }

    /// The verdict on a machine that sees the inertial samples a little differently.
    fn verdict_when(change: impl Fn(&mut ImuData)) -> Verdict {
        let (mut inputs, start, _) = flown();
        let golden = golden();
        let mut outputs = Outputs { topic: golden.output, ..Outputs::default() };
        let report = played(&encode(&golden, &inputs, start, &[], 0), &mut outputs).expect("plays");
        for input in &mut inputs {
            if let Event::Sample { topic, words, .. } = input
                && *topic == Id::sensor_imu as usize
            {
                let mut sample = ImuData::from_words(&words.as_slice().try_into().expect("its size")).expect("any");
                change(&mut sample);
                *words = sample.to_words().to_vec();
            }
        }
        let changed = encode(&golden, &inputs, start, &outputs.of_turns, report.hash);
        played(&changed, &mut ()).expect("plays").verdict
    }

    #[test]
    fn what_is_played_is_what_was_flown() {
        let (inputs, start, hash) = flown();
        let (_, report) = write(&golden(), &inputs, start).expect("plays");
        assert_eq!((report.verdict, report.hash), (Verdict::Identical, hash));
    }

    #[test]
    fn every_sensor_is_new_in_one_activation_now_and_then() {
        #[derive(Default)]
        struct Gatherings(usize);
        impl Observer for Gatherings {
            fn has_read(&mut self, activation: &Activation) {
                // Inertial sample, range, flow, field, pressure.
                let all = activation
                    .record()
                    .inputs()
                    .get(..5)
                    .is_some_and(|inputs| inputs.iter().all(|input| input.taken > 0));
                self.0 += usize::from(activation.record().index == 0 && all);
            }
        }
        impl PlayObserver for Gatherings {}
        let mut gatherings = Gatherings::default();
        let report = played(FLIGHT, &mut gatherings).expect("plays");
        let expected = (report.duration.as_micros() / GATHERING.as_micros()) as usize;
        assert!(gatherings.0 >= expected, "{} of {expected}", gatherings.0);
    }

    #[test]
    fn rounding_is_told_from_nonsense() {
        let rounding = |value: &mut f32| *value = f32::from_bits(value.to_bits() ^ 1);
        let slightly = verdict_when(|imu| imu.gyro.iter_mut().chain(imu.accel.iter_mut()).for_each(rounding));
        assert!(matches!(slightly, Verdict::WithinTolerance { worst } if worst < TOLERANCE / 10.0), "{slightly:?}");
        let wrong = verdict_when(|imu| imu.gyro.x = -imu.gyro.x);
        assert!(matches!(wrong, Verdict::Beyond { .. }), "{wrong:?}");
        let nothing = verdict_when(|imu| imu.accel.z = f32::NAN);
        assert!(matches!(nothing, Verdict::Beyond { .. }), "{nothing:?}");
    }

    #[test]
    fn other_bytes_are_refused() {
        let changed = |place: usize| {
            let mut record = FLIGHT.to_vec();
            record[place] ^= 1;
            played(&record, &mut ()).expect_err("refused")
        };
        assert_eq!([0, 4, 8].map(changed), [GoldenError::NotGolden, GoldenError::Damaged, GoldenError::OtherTables]);
        for length in [0, 3, 31, 32, FLIGHT.len() - 1] {
            assert!(played(&FLIGHT[..length], &mut ()).is_err(), "{length}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn a_damaged_record_is_noticed(place in 16..FLIGHT.len(), flip in 1u8..) {
            let mut record = FLIGHT.to_vec();
            record[place] ^= flip;
            let outcome = played(&record, &mut ());
            prop_assert!(outcome.is_err() || outcome.is_ok_and(|report| report.verdict != Verdict::Identical));
        }
    }
}
