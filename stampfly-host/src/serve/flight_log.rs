//! The log of a served vehicle: while it is armed, a few seconds before, and a few after.
//!
//! A log grows by half a megabyte a second, and a vehicle may stand for a night. While it is
//! disarmed, messages wait in memory, in parts that begin with a key frame, and only the newest
//! parts are kept. Arming writes them, and everything that follows until some seconds after
//! disarming. A dropout message marks the gap between two flights, and a replay continues at the
//! key frame behind it.

use crate::log_file::LogFile;
use stampfly_log::ulog::Sink;
use stampfly_sim::vehicle::Witness;
use stampfly_types::messages::FlightStatus;
use stampfly_types::{Instant, Message as _};
use std::collections::VecDeque;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Parts before arming that are kept, and after disarming that are written. A recorder begins one a
/// second.
const BEFORE: usize = 5;
const AFTER: usize = 10;
/// The kind of a message that begins a part, and of one that says how much is missing.
const MARK: u8 = b'S';
const LOSS: u8 = b'O';

/// Is the vehicle armed? The flight sets it, its log reads it.
#[derive(Clone, Debug, Default)]
pub struct Armed(Arc<AtomicBool>);

/// Sets an [`Armed`] from a flight's samples.
#[derive(Debug)]
pub struct ArmedWitness {
    armed: Armed,
    /// The place of `flight_status` among the topics.
    status: Option<usize>,
}

impl Armed {
    /// Follows a flight of a vehicle with these topics.
    #[must_use]
    pub fn witness(&self, topics: &[stampfly_bus::TopicInfo]) -> ArmedWitness {
        let status = topics.iter().position(|topic| topic.name == "flight_status");
        // A vehicle that does not say whether it is armed is logged all the time.
        self.0.store(status.is_none(), Ordering::Relaxed);
        ArmedWitness { armed: self.clone(), status }
    }

    fn get(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

impl<R: stampfly_bus::Schedule> Witness<R> for ArmedWitness {
    fn published(&mut self, topic: usize, _: Instant, _: u32, words: &[u32]) {
        if Some(topic) == self.status
            && let Some(status) = words.try_into().ok().and_then(FlightStatus::from_words)
        {
            self.armed.0.store(status.armed, Ordering::Relaxed);
        }
    }
}

impl stampfly_flight::Observer for ArmedWitness {}

/// The log. A [`Sink`] of a recorder that begins each part with a mark.
#[derive(Debug)]
pub struct FlightLog {
    file: LogFile,
    armed: Armed,
    /// Bytes in the file, and the most that it may have.
    written: u64,
    limit: u64,
    /// Are messages written at once? Those of the head are.
    is_writing: bool,
    /// Parts that were written since the vehicle is disarmed.
    after: usize,
    /// The parts that wait.
    parts: VecDeque<Vec<u8>>,
    /// Parts that are missing between what is written and what waits.
    missing: u64,
}

impl FlightLog {
    /// Writes into this file, up to `limit` bytes.
    #[must_use]
    pub fn new(file: LogFile, armed: Armed, limit: u64) -> Self {
        // The head ends with the first mark, long after nothing is armed.
        let (is_writing, after) = (true, AFTER);
        Self { file, armed, written: 0, limit, is_writing, after, parts: VecDeque::new(), missing: 0 }
    }

    /// Ends the log with the parts that wait, so that a vehicle that was never armed has a log,
    /// too.
    ///
    /// # Errors
    /// When the disk does not take it.
    pub fn finish(mut self) -> io::Result<()> {
        self.begin()?;
        self.file.flush()
    }

    /// A part begins.
    fn part(&mut self) {
        let is_armed = self.armed.get();
        if self.is_writing {
            self.after = if is_armed { 0 } else { self.after + 1 };
            self.is_writing = self.after <= AFTER;
        }
        if !self.is_writing {
            if self.parts.len() > BEFORE {
                self.parts.pop_front();
                self.missing += 1;
            }
            self.parts.push_back(Vec::new());
        }
    }

    /// Writes the parts that wait. The messages that follow are written at once.
    fn begin(&mut self) -> io::Result<()> {
        let missing = core::mem::take(&mut self.missing);
        if missing > 0 {
            // A mark of loss has milliseconds, and says a minute at most.
            let [low, high] = u16::try_from(missing * 1_000).unwrap_or(u16::MAX).to_le_bytes();
            self.put(&[2, 0, LOSS, low, high])?;
        }
        for part in core::mem::take(&mut self.parts) {
            self.put(&part)?;
        }
        (self.is_writing, self.after) = (true, 0);
        Ok(())
    }

    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        let written = self.written + bytes.len() as u64;
        if written > self.limit {
            return Err(io::ErrorKind::StorageFull.into());
        }
        self.written = written;
        self.file.write(bytes)
    }
}

impl Sink for FlightLog {
    type Error = io::Error;

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        if bytes.get(2) == Some(&MARK) {
            self.part();
        }
        if !self.is_writing && self.armed.get() {
            self.begin()?;
        }
        match self.parts.back_mut().filter(|_| !self.is_writing) {
            Some(part) => {
                part.extend_from_slice(bytes);
                Ok(())
            }
            None => self.put(bytes),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A second of a flight: a mark, and its number.
    fn second(log: &mut FlightLog, number: u8) {
        log.write(&[8, 0, MARK, 0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12]).expect("room");
        log.write(&[1, 0, b'D', number]).expect("room");
    }

    /// The seconds that are in the file, and where some are missing.
    fn seconds(bytes: &[u8]) -> Vec<String> {
        let (mut rest, mut found) = (bytes, Vec::new());
        while let [low, high, kind, behind @ ..] = rest {
            let (body, behind) = behind.split_at(usize::from(u16::from_le_bytes([*low, *high])));
            match *kind {
                b'D' => found.push(body[0].to_string()),
                LOSS => found.push(format!("lost {} s", u16::from_le_bytes([body[0], body[1]]) / 1_000)),
                _ => {}
            }
            rest = behind;
        }
        found
    }

    fn log(name: &str, limit: u64) -> (FlightLog, Armed, std::path::PathBuf) {
        let path = std::env::temp_dir().join(format!("stampfly-flight-log-{name}-{}", std::process::id()));
        let armed = Armed::default();
        (FlightLog::new(LogFile::create(path.clone()).expect("a file"), armed.clone(), limit), armed, path)
    }

    #[test]
    fn it_holds_what_is_armed_and_seconds_before_and_after() {
        let (mut log, armed, path) = log("armed", 1 << 20);
        log.write(&[1, 0, b'F', 0]).expect("the head");
        for number in 0..100 {
            armed.0.store((40..50).contains(&number) || (70..72).contains(&number), Ordering::Relaxed);
            second(&mut log, number);
        }
        log.finish().expect("written");
        let found = seconds(&std::fs::read(&path).expect("the file"));
        std::fs::remove_file(path).expect("the file");
        let first: Vec<_> = ["lost 35 s".to_owned()].into_iter().chain((35..60).map(|s| s.to_string())).collect();
        assert_eq!(found[..first.len()], first[..]);
        assert!(
            found.contains(&"71".to_owned()) && !found.contains(&"62".to_owned()) && !found.contains(&"85".to_owned())
        );
        assert_eq!(found.iter().filter(|second| second.starts_with("lost")).count(), 3, "{found:?}");
        assert_eq!(found.last().map(String::as_str), Some("99"));
    }

    #[test]
    fn a_vehicle_that_is_never_armed_has_the_last_seconds() {
        let (mut log, _, path) = log("disarmed", 1 << 20);
        log.write(&[1, 0, b'F', 0]).expect("the head");
        (0..200).for_each(|number| second(&mut log, number));
        log.finish().expect("written");
        let bytes = std::fs::read(&path).expect("the file");
        std::fs::remove_file(path).expect("the file");
        let found = seconds(&bytes);
        assert_eq!((found.len(), found[0].as_str()), (BEFORE + 2, "lost 65 s"), "{found:?}");
        assert!(bytes.len() < 200);
    }

    #[test]
    fn it_does_not_grow_without_end() {
        let (mut log, armed, path) = log("limit", 100);
        armed.0.store(true, Ordering::Relaxed);
        let refused = (0..100).filter(|number| log.write(&[1, 0, b'D', *number]).is_err()).count();
        log.finish().expect("written");
        let length = std::fs::read(&path).expect("the file").len();
        std::fs::remove_file(path).expect("the file");
        assert_eq!((length, refused), (100, 75));
    }
}
