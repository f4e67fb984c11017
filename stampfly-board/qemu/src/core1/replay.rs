//! Replays what the emulated flight core has recorded: `stampfly-core1-replay FILE`, with what it has printed.
//!
//! Then one bit of one sample is changed after the other, and the replay has to name what differs.

use stampfly_board::VehicleConfig;
use stampfly_board::schedule::Runnables;
use stampfly_board::topics::{Id, TOPICS};
use stampfly_flight::compact::{self, Contents, Samples};
use stampfly_flight::replay::{Replay, ReplayOptions, replay};
use stampfly_flight::{Recorder, black_box};
use stampfly_log::ulog::{Message, Reader};
use stampfly_sim::recorder::Memory;
use stampfly_types::{Duration, Instant};
use std::collections::BTreeMap;
use std::process::ExitCode;

/// The least that has to be replayed.
const LEAST: Duration = Duration::from_secs(20);

/// The bytes of the record in what was printed.
fn record(said: &str) -> Option<Vec<u8>> {
    let digits: String = said.lines().filter_map(|line| line.strip_prefix("record ")).collect();
    (0..digits.len() / 2).map(|at| u8::from_str_radix(digits.get(2 * at..2 * at + 2)?, 16).ok()).collect()
}

/// The record as a log, and what was in it.
fn log(record: &[u8]) -> Result<(Vec<u8>, Contents), String> {
    let config = VehicleConfig::default();
    let log = black_box::open(Memory::default(), Instant::ZERO, "stampfly", &config, "emulated board");
    let mut log = Recorder::<Runnables, _>::new(log.map_err(|_| "no head")?);
    let contents = compact::read(record, &config, Samples::Recorded, &mut log).map_err(|error| error.to_string())?;
    Ok((log.into_sink().0, contents))
}

fn again(log: &[u8]) -> Result<Replay, String> {
    let options = ReplayOptions { from: Some(Instant::ZERO), is_thinned: true };
    replay::<Runnables>(log, VehicleConfig::default(), |_, _, _| true, options).map_err(|error| error.to_string())
}

/// Flips a bit of the first field of a sample of this topic, so far into its samples: the value changes by less than a hundredth.
/// One in the last place of an acceleration would be rounded away, and nothing would differ. Returns its instant.
fn change(log: &mut [u8], topic: Id, share: f64) -> Option<Instant> {
    let name = TOPICS[topic as usize].name;
    let (mut places, mut ids) = (Vec::new(), BTreeMap::new());
    let mut reader = Reader::new(log).ok()?;
    while let Some(message) = reader.next() {
        match message.ok()? {
            Message::Subscription { id, topic, .. } => _ = ids.insert(id, topic.to_owned()),
            Message::Data { id, payload } if ids.get(&id).is_some_and(|known| known == name) => {
                let at = Instant::from_micros(u64::from_le_bytes(*payload.first_chunk()?));
                places.push((at, reader.offset() - payload.len()));
            }
            _ => {}
        }
    }
    let (at, begin) = *places.get((share * places.len() as f64) as usize)?;
    // Behind time stamp and generation, and two bytes of the number.
    *log.get_mut(begin + 14)? ^= 1;
    Some(at)
}

fn run(path: &str) -> Result<(), String> {
    let said = std::fs::read_to_string(path).map_err(|error| format!("{path}: {error}"))?;
    let record = record(&said).filter(|record| !record.is_empty()).ok_or("no record")?;
    let (log, contents) = log(&record)?;
    println!("{contents:?}");
    let replayed = again(&log)?;
    println!("{replayed:?}");
    let rate = record.len() as f64 / replayed.duration.seconds_f64();
    println!("{} bytes of record, {rate:.0} bytes per second; {} as a log", record.len(), log.len());
    if let Some(difference) = replayed.difference {
        return Err(difference.to_string());
    }
    if contents.gaps > 0 || contents.lost > 0 || contents.idle_since.is_some() {
        return Err(format!("something is missing: {contents:?}"));
    }
    if replayed.duration < LEAST || replayed.gaps > 0 || replayed.key_frames == 0 {
        return Err(format!("replayed {} with {} gaps; at least {LEAST} is the bar", replayed.duration, replayed.gaps));
    }
    for topic in [Id::sensor_imu, Id::actuator_motor] {
        let mut changed = log.clone();
        let at = change(&mut changed, topic, 0.5).ok_or("nothing to change")?;
        let name = TOPICS[topic as usize].name;
        match again(&changed)?.difference {
            Some(difference) => println!("{name} at {at} changed by a bit: {difference}"),
            None => return Err(format!("{name} at {at} changed by a bit, and nobody noticed")),
        }
    }
    Ok(())
}

fn main() -> ExitCode {
    let Some(path) = std::env::args().nth(1) else {
        eprintln!("usage: stampfly-core1-replay FILE");
        return ExitCode::from(2);
    };
    match run(&path) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{path}: {error}");
            ExitCode::FAILURE
        }
    }
}
