//! The golden flight: a short recorded flight and what the flight stack made of it, to ask any machine whether it
//! computes the same.
//!
//! [`FLIGHT`] holds every sample that came from outside during a simulated hop of a few seconds (sensors, commands,
//! button), every turn of the executor, and what the motors were told. [`play`] feeds it to a vehicle of its own and
//! compares. Same machine or another, the answer should be [`Verdict::Identical`]: the same bits on every topic. A
//! compiler that contracts or reorders floating point shows as [`Verdict::WithinTolerance`], a broken one, or broken
//! memory, as [`Verdict::Beyond`], and such a machine should not fly.
//!
//! Meant for the self test at power-on and for emulated cores. It takes no clock, no heap and, with the stack's own
//! default parameters, no argument. It needs room for a whole vehicle on the call stack, see [`STACK`].
//!
//! Not a test of the flight stack's quality, nor of sensors: the record does not react. `cargo xtask golden --fix`
//! records it again when the flight stack has changed on purpose.

mod format;

pub use format::{MOTORS, Writer, tables};

use crate::vehicle::{Assembled, assemble};
use crate::{FlightLoop, Observer, VehicleConfig, plan, wiring};
use core::fmt;
use format::Entry;
use stampfly_bus::Band;
use stampfly_log::FlightHash;
use stampfly_types::messages::MotorOutput;
use stampfly_types::{Duration, Instant};

/// The golden flight of this version.
pub const FLIGHT: &[u8] = include_bytes!("../../golden/flight.bin");

/// Largest deviation of a motor's duty that may still be rounding.
///
/// Sensors that are wrong in their last bits move a duty by less than a tenth of this, which a test of the program that
/// records asserts: the record does not react, so errors do not build up.
pub const TOLERANCE: f32 = 0.01;

/// What [`play`] puts on the call stack: a bus and a vehicle, bytes.
pub const STACK: usize = size_of::<wiring::Bus>() + size_of::<plan::Vehicle<'_>>() + size_of::<FlightLoop<'_>>();

/// What a machine made of a golden flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// Every bit of every topic was the same.
    Identical,
    /// Bits differ, duties hardly.
    WithinTolerance {
        /// Largest deviation of a motor's duty.
        worst: f32,
    },
    /// This machine computes something else.
    Beyond {
        /// Largest deviation of a motor's duty; infinite when one was no number.
        worst: f32,
        /// When the tolerance was first exceeded.
        since: Instant,
    },
}

/// How a golden flight went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// The answer.
    pub verdict: Verdict,
    /// Hash over everything published, as [`FlightHash`] defines it.
    pub hash: u64,
    /// Messages published.
    pub messages: u64,
    /// Length of the flight.
    pub duration: Duration,
}

/// Why a golden flight could not be played.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum GoldenError {
    /// These bytes are something else.
    NotGolden,
    /// Recorded with other topics or runnables: another version's.
    OtherTables,
    /// Bytes are missing, too many or make no sense.
    Damaged,
}

impl fmt::Display for GoldenError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotGolden => "not a golden flight",
            Self::OtherTables => "the golden flight was recorded with other topics or runnables",
            Self::Damaged => "the golden flight is damaged",
        })
    }
}

impl core::error::Error for GoldenError {}

/// Somebody who wants to see more of a golden flight than its report: a log, a profiler, a watchdog to be fed.
pub trait Witness: Observer {
    /// The executor begins to look what is due in a band.
    fn band_begins(&mut self, _band: Band, _clock: Instant) {}

    /// Nothing more is due in this band.
    fn band_ended(&mut self, _band: Band) {}

    /// Somebody has published.
    fn published(&mut self, _topic: wiring::Id, _at: Instant, _generation: u32, _words: &[u32]) {}
}

/// Nobody watches.
impl Witness for () {}

/// Plays a golden flight on a vehicle of its own and compares.
///
/// ```
/// use stampfly_board::golden::{self, Verdict};
/// let report = golden::play(golden::FLIGHT, &mut ())?;
/// assert_eq!(report.verdict, Verdict::Identical);
/// # Ok::<(), golden::GoldenError>(())
/// ```
///
/// # Errors
/// When the record is none, is damaged, or belongs to another version.
pub fn play(record: &[u8], witness: &mut impl Witness) -> Result<Report, GoldenError> {
    let (header, entries) = format::open(record)?;
    let mut bus = wiring::Bus::new();
    let wiring::Split { ports, mut taps, heads } = bus.split(None);
    // Not taken apart by value: a second copy of a vehicle is more than some stacks can spare.
    let mut assembled = assemble(ports, heads, &VehicleConfig::default(), header.start);
    let Assembled { flight_loop, outside } = &mut assembled;
    let mut hash = FlightHash::new();
    let mut drain = |hash: &mut FlightHash, witness: &mut _| drain(&mut taps, hash, witness);
    let (mut clock, mut deviation) = (header.start, Deviation::default());
    for entry in entries {
        match entry? {
            Entry::Sample { topic, at, words } => {
                outside.publish_words(topic, at, &words).ok_or(GoldenError::Damaged)?;
                // At once, so that samples enter the hash in the order in which they came.
                drain(&mut hash, witness);
            }
            Entry::Turn(now) => {
                clock = now;
                for band in [Band::Flight, Band::Background] {
                    witness.band_begins(band, now);
                    flight_loop.run_band(band, now, witness);
                    witness.band_ended(band);
                }
                drain(&mut hash, witness);
            }
            Entry::Duty(expected) => {
                let told = outside.motors.latest().map_or(MotorOutput::default().duty, |output| output.data.duty);
                deviation.add(clock, &expected, &told);
            }
        }
    }
    let verdict = match deviation {
        Deviation { worst: 0.0, .. } if hash.finish() == header.hash => Verdict::Identical,
        Deviation { worst, since: None } => Verdict::WithinTolerance { worst },
        Deviation { worst, since: Some(since) } => Verdict::Beyond { worst, since },
    };
    let duration = clock.since(header.start);
    Ok(Report { verdict, hash: hash.finish(), messages: hash.messages(), duration })
}

fn drain(taps: &mut wiring::Taps<'_>, hash: &mut FlightHash, witness: &mut impl Witness) {
    taps.drain(&mut |topic, at, generation, words| {
        hash.publish(topic as u16, generation, at, words);
        witness.published(topic, at, generation, words);
    });
}

/// How far the duties are from what was recorded.
#[derive(Default)]
struct Deviation {
    worst: f32,
    since: Option<Instant>,
}

impl Deviation {
    fn add(&mut self, clock: Instant, expected: &[f32; MOTORS], told: &[f32]) {
        for (expected, told) in expected.iter().zip(told) {
            let deviation = (told - expected).abs();
            let deviation = if deviation.is_nan() { f32::INFINITY } else { deviation };
            self.worst = self.worst.max(deviation);
            if deviation > TOLERANCE {
                self.since.get_or_insert(clock);
            }
        }
    }
}
