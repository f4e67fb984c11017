//! Records the golden flight: a hop in simulation, as what came from outside and what the motors were told.
//!
//! Two things are done to the flight before it is written. It ends when the motors have stood still for a moment. And
//! twice a second, where all other sensors' samples come closest together, they are held back by those few milliseconds
//! until they are new in one activation: by chance that happens once in minutes, and it is what a step costs most. Their
//! stamps stay, so the estimator sees late samples, as it does of a busy bus. What the motors are to be told is what they
//! are told when this record is played here.

use crate::mission::Mission;
use crate::recorder::Recorder;
use crate::replay::is_outside;
use crate::simulate::{FlightConfig, fly};
use stampfly_board::golden::{GoldenError, MOTORS, Report, Witness, Writer, play};
use stampfly_board::{Observer, wiring};
use stampfly_bus::{Activation, Band};
use stampfly_types::{Duration, Instant, Message, messages::MotorOutput};
use std::collections::BTreeMap;
use std::fmt;

/// The shortest flight that has everything: calibration, standing, arming, take-off, hovering, landing.
const MISSION: &str = "arm\ntakeoff 0.2\nhover 0.3\nland\n";
/// The record goes on for this long after the last change of state.
const TAIL: Duration = Duration::from_millis(100);
/// The duties are written down so often.
const DUTY_PERIOD: Duration = Duration::from_millis(20);
/// Time between the activations in which every sensor has something new.
const GATHERING: Duration = Duration::from_millis(500);
/// The sensors that are gathered.
const GATHERED: [wiring::Id; 5] = [
    wiring::Id::sensor_tof,
    wiring::Id::sensor_flow,
    wiring::Id::sensor_mag,
    wiring::Id::sensor_baro,
    wiring::Id::sensor_power,
];

/// What a vehicle was given.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// Somebody outside published.
    Sample {
        /// The topic.
        topic: wiring::Id,
        /// The sample's instant.
        at: Instant,
        /// The message.
        words: Vec<u32>,
    },
    /// The executor ran what was due.
    Turn(Instant),
}

/// Collects what a vehicle is given, in order.
#[derive(Clone, Debug, Default)]
pub struct Inputs {
    collected: Vec<Event>,
    turn: Option<Instant>,
}

impl Inputs {
    /// The executor is about to look what is due.
    pub(crate) fn turn(&mut self, clock: Instant) {
        self.turn = Some(clock);
    }

    /// Something was due.
    pub(crate) fn activation(&mut self) {
        self.collected.extend(self.turn.take().map(Event::Turn));
    }

    pub(crate) fn sample(&mut self, topic: wiring::Id, at: Instant, words: &[u32]) {
        if is_outside(topic as usize) {
            self.collected.push(Event::Sample { topic, at, words: words.to_vec() });
        }
    }

    /// What was collected.
    #[must_use]
    pub fn into_collected(self) -> Vec<Event> {
        self.collected
    }
}

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

/// Flies and records the golden flight.
///
/// # Errors
/// When it was not flown to its end, or its record cannot be played.
pub fn record() -> Result<Vec<u8>, RecordError> {
    let config = configuration().ok_or(RecordError::Flight)?;
    let mut recorder = Recorder::hash_only().with_inputs();
    let outcome = fly(&config, &mut recorder, &mut |_, _| {});
    let end = outcome.phases.last().map(|phase| phase.since + TAIL).filter(|_| outcome.finished);
    let mut inputs = recorder.into_inputs();
    shorten(&mut inputs, end.ok_or(RecordError::Flight)?);
    gather(&mut inputs, config.simulation.start);
    Ok(write(&inputs, config.simulation.start)?.0)
}

fn configuration() -> Option<FlightConfig> {
    Some(FlightConfig { mission: Mission::parse(MISSION).ok()?, ..FlightConfig::reference(1) })
}

/// Leaves out what happened after `end`.
fn shorten(inputs: &mut Vec<Event>, end: Instant) {
    let late = |input: &Event| matches!(input, Event::Turn(clock) if *clock > end);
    if let Some(first) = inputs.iter().position(late) {
        inputs.truncate(first);
    }
}

/// Now and then, when the samples of all other sensors are youngest, holds them back until the next inertial sample comes.
fn gather(inputs: &mut Vec<Event>, start: Instant) {
    let mut newest = [None; GATHERED.len()];
    // Of each stretch of time, the inertial sample that the others are closest to: age of the oldest, and places.
    let mut closest: BTreeMap<u64, (Duration, usize, [usize; GATHERED.len()])> = BTreeMap::new();
    for (place, input) in inputs.iter().enumerate() {
        match input {
            Event::Sample { topic: wiring::Id::sensor_imu, at, .. } => {
                let [Some(tof), Some(flow), Some(mag), Some(baro), Some(power)] = newest else { continue };
                // The battery's slow monitor would decide alone; nobody asks it for its age.
                let age = [tof, flow, mag, baro].map(|(seen, _): (Instant, _)| at.since(seen));
                let oldest = age.into_iter().max().unwrap_or_default();
                let stretch = at.since(start).as_micros() / GATHERING.as_micros();
                let best = closest.get(&stretch).is_some_and(|(best, ..)| *best <= oldest);
                if !best {
                    closest.insert(stretch, (oldest, place, [tof, flow, mag, baro, power].map(|(_, place)| place)));
                }
            }
            Event::Sample { topic, at, .. } => {
                let sensor = GATHERED.iter().position(|id| id == topic);
                if let Some(newest) = sensor.and_then(|sensor| newest.get_mut(sensor)) {
                    *newest = Some((*at, place));
                }
            }
            Event::Turn(_) => {}
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

/// Writes a record of these inputs, with what comes of them here.
fn write(inputs: &[Event], start: Instant) -> Result<(Vec<u8>, Report), GoldenError> {
    // Played once without expecting anything, to find out what to expect.
    let mut duties = Duties::default();
    let first = play(&encode(inputs, start, &[], 0), &mut duties)?;
    let record = encode(inputs, start, &duties.of_turns, first.hash);
    let report = play(&record, &mut ())?;
    Ok((record, report))
}

/// The bytes of a record: inputs, the duties after each of its turns, and the hash.
fn encode(inputs: &[Event], start: Instant, duties: &[[f32; MOTORS]], hash: u64) -> Vec<u8> {
    let mut entries = Vec::new();
    let mut writer = Writer::new(start, |bytes: &[u8]| entries.extend_from_slice(bytes));
    let (mut duties, mut due) = (duties.iter(), start);
    for input in inputs {
        match input {
            Event::Sample { topic, at, words } => writer.sample(*topic as u8, *at, words),
            Event::Turn(clock) => {
                writer.turn(*clock);
                let duty = duties.next();
                if let Some(duty) = duty.filter(|_| *clock >= due) {
                    due = *clock + DUTY_PERIOD;
                    writer.duty(duty);
                }
            }
        }
    }
    let mut record = writer.header(hash).to_vec();
    record.append(&mut entries);
    record
}

/// What the motors were told after each turn.
#[derive(Default)]
struct Duties {
    now: [f32; MOTORS],
    of_turns: Vec<[f32; MOTORS]>,
}

impl Observer for Duties {
    fn has_read(&mut self, _: usize, _: &Activation) {}
}

impl Witness for Duties {
    fn published(&mut self, topic: wiring::Id, _: Instant, _: u32, words: &[u32]) {
        let output = words.try_into().ok().and_then(|words| MotorOutput::from_words(&words));
        if let (wiring::Id::actuator_motor, Some(output)) = (topic, output) {
            self.now = std::array::from_fn(|motor| output.duty[motor]);
            if let Some(last) = self.of_turns.last_mut() {
                *last = self.now;
            }
        }
    }

    fn band_begins(&mut self, band: Band, _: Instant) {
        if band == Band::Flight {
            self.of_turns.push(self.now);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use stampfly_board::golden::{FLIGHT, TOLERANCE, Verdict};
    use stampfly_types::messages::ImuData;

    /// The golden flight as it was flown, with its hash.
    fn flown() -> (Vec<Event>, Instant, u64) {
        let config = configuration().expect("a mission");
        let mut recorder = Recorder::hash_only().with_inputs();
        let outcome = fly(&config, &mut recorder, &mut |_, _| {});
        (recorder.into_inputs(), config.simulation.start, outcome.log_hash)
    }

    /// The verdict on a machine that sees the inertial samples a little differently.
    fn verdict_when(change: impl Fn(&mut ImuData)) -> Verdict {
        let (mut inputs, start, _) = flown();
        let mut duties = Duties::default();
        let report = play(&encode(&inputs, start, &[], 0), &mut duties).expect("plays");
        for input in &mut inputs {
            if let Event::Sample { topic: wiring::Id::sensor_imu, words, .. } = input {
                let mut sample = ImuData::from_words(&words.as_slice().try_into().expect("its size")).expect("any");
                change(&mut sample);
                *words = sample.to_words().to_vec();
            }
        }
        let changed = encode(&inputs, start, &duties.of_turns, report.hash);
        play(&changed, &mut ()).expect("plays").verdict
    }

    #[test]
    fn what_is_played_is_what_was_flown() {
        let (inputs, start, hash) = flown();
        let (_, report) = write(&inputs, start).expect("plays");
        assert_eq!((report.verdict, report.hash), (Verdict::Identical, hash));
    }

    #[test]
    fn every_sensor_is_new_in_one_activation_now_and_then() {
        #[derive(Default)]
        struct Gatherings(usize);
        impl Observer for Gatherings {
            fn has_read(&mut self, index: usize, activation: &Activation) {
                // Inertial sample, range, flow, field, pressure.
                let all = activation.inputs().get(..5).is_some_and(|inputs| inputs.iter().all(|input| input.taken > 0));
                self.0 += usize::from(index == 0 && all);
            }
        }
        impl Witness for Gatherings {}
        let mut gatherings = Gatherings::default();
        let report = play(FLIGHT, &mut gatherings).expect("plays");
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
            play(&record, &mut ()).expect_err("refused")
        };
        assert_eq!([0, 4, 8].map(changed), [GoldenError::NotGolden, GoldenError::Damaged, GoldenError::OtherTables]);
        for length in [0, 3, 31, 32, FLIGHT.len() - 1] {
            assert!(play(&FLIGHT[..length], &mut ()).is_err(), "{length}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn a_damaged_record_is_noticed(place in 16..FLIGHT.len(), flip in 1u8..) {
            let mut record = FLIGHT.to_vec();
            record[place] ^= flip;
            let outcome = play(&record, &mut ());
            prop_assert!(outcome.is_err() || outcome.is_ok_and(|report| report.verdict != Verdict::Identical));
        }
    }
}
