//! The golden flight: a short recorded flight and what the vehicle made of it, to check that a machine computes the same.
//!
//! The record holds every sample that came from outside, every turn of the executor, and now and then the newest sample
//! of one output topic, say the motors. [`play`] feeds it to a vehicle of its own and compares. The answer should be
//! [`Verdict::Identical`]: the same bits on every topic. A compiler that contracts or reorders floating point shows as
//! [`Verdict::WithinTolerance`], a broken one, or broken memory, as [`Verdict::Beyond`]; such a machine should not fly.
//!
//! For the self test at power-on, for emulated cores and for other build profiles. It reads no clock and needs no heap, but
//! room for a whole vehicle on the stack ([`stack_size`]). Not a test of how well a vehicle flies, nor of its sensors:
//! the record does not react.

mod error;
mod format;
mod outcome;

pub use error::GoldenError;
pub use format::{Writer, tables};
pub use outcome::Outcome;

use crate::newest::MAX_MESSAGE;
use crate::{Assembled, FlightLoop, InPlace, Observer};
use core::mem::MaybeUninit;
use format::{Entry, Header, Reader};
use heapless::Vec;
use stampfly_bus::{Band, PublishWords, Schedule, Taps, TopicTable};
use stampfly_log::FlightHash;
use stampfly_types::{Duration, FieldInfo, FieldKind, Instant, leaves};

/// What a machine made of a golden flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// Every bit of every topic was the same.
    Identical,
    /// Some bits differ; the output is within the tolerance.
    WithinTolerance {
        /// Largest deviation of a number in the output.
        worst: f32,
    },
    /// The machine computes something else.
    Beyond {
        /// Largest deviation of a number in the output; infinite when it is not a number, or the output is missing.
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

/// Is told more of a golden flight than its report: a log, a profiler, a watchdog to be fed.
pub trait PlayObserver: Observer {
    /// The executor is about to run a band.
    fn band_starts(&mut self, _band: Band, _clock: Instant) {}

    /// Nothing more is due in this band.
    fn band_finished(&mut self, _band: Band) {}

    /// A sample was published on the topic at this place in the table.
    fn published(&mut self, _topic: usize, _at: Instant, _generation: u32, _words: &[u32]) {}
}

/// Nothing to report to.
impl PlayObserver for () {}

/// What [`play`] needs on the stack for a bus and a vehicle, bytes.
#[must_use]
pub const fn stack_size<R: Schedule>() -> usize {
    size_of::<R::Topics>() + size_of::<Assembled<'static, R>>()
}

/// Plays a golden flight on a vehicle of its own and compares. Nothing may have been published on `bus`; it is an argument
/// so that it may lie elsewhere than on the stack. `tolerance` is the largest deviation of a number in the output that may
/// still be rounding.
///
/// ```
/// # mod rover { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/flight/common/mod.rs")); }
/// use rover::{Rover, topics::{Bus, Id}}; // the rover of `tests/flight/common`, configured by a gain
/// use stampfly_flight::golden::{Verdict, Writer, play, tables};
/// use stampfly_types::{Instant, Message, messages::{MotorOutput, TofData}};
///
/// # fn main() -> Result<(), stampfly_flight::golden::GoldenError> {
/// // One range, and the duty that the rover makes of it.
/// let mut entries = Vec::new();
/// let out = |piece: &[u8]| entries.extend_from_slice(piece);
/// let mut writer = Writer::new(tables::<Rover>(), Instant::ZERO, Id::actuator_motor as usize, out);
/// let range = TofData { distance: 1.5, valid: true, ..Default::default() };
/// writer.sample(Id::sensor_range as usize, Instant::from_millis(1), &range.to_words());
/// writer.turn(Instant::from_millis(2));
/// let mut motors = MotorOutput { count: 2, armed: true, ..Default::default() };
/// (motors.duty[0], motors.duty[1]) = (0.75, 0.75);
/// writer.output(&motors.to_words());
/// let mut record = writer.header(0).to_vec();
/// record.append(&mut entries);
///
/// // The hash is unknown before the first play.
/// let report = play::<Rover>(&mut Bus::new(), &record, &0.5, 0.01, &mut ())?;
/// assert_eq!(report.verdict, Verdict::WithinTolerance { worst: 0.0 });
/// record[24..32].copy_from_slice(&report.hash.to_le_bytes());
/// assert_eq!(play::<Rover>(&mut Bus::new(), &record, &0.5, 0.01, &mut ())?.verdict, Verdict::Identical);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// When the record is none, is damaged, or was recorded with other tables.
pub fn play<R: Schedule>(
    bus: &mut R::Topics,
    record: &[u8],
    config: &R::Config,
    tolerance: f32,
    observer: &mut impl PlayObserver,
) -> Result<Report, GoldenError> {
    play_in::<R>(&mut MaybeUninit::uninit(), bus, record, config, tolerance, observer)
}

/// Where [`play_in`] makes a vehicle.
pub type Place<'b, R> = MaybeUninit<FlightLoop<'b, R>>;

/// As [`play`], for a stack that has no room for a vehicle: it is made in `place`.
///
/// # Errors
/// As [`play`].
pub fn play_in<'b, R: Schedule>(
    place: &'b mut Place<'b, R>,
    bus: &'b mut R::Topics,
    record: &[u8],
    config: &R::Config,
    tolerance: f32,
    observer: &mut impl PlayObserver,
) -> Result<Report, GoldenError> {
    let (header, entries) = format::open::<R>(record)?;
    let vehicle = Assembled::in_place(place, bus, None, config, header.start);
    play_entries(vehicle, header, entries, tolerance, observer)
}

/// Plays the entries on a vehicle. Apart, so that what they need is not on the stack while the vehicle is made, which needs most.
#[inline(never)]
fn play_entries<R: Schedule>(
    vehicle: InPlace<'_, R>,
    header: Header,
    entries: Reader<'_>,
    tolerance: f32,
    observer: &mut impl PlayObserver,
) -> Result<Report, GoldenError> {
    let InPlace { flight_loop, mut outside, mut taps } = vehicle;
    let (mut hash, mut output) = (FlightHash::new(), Vec::<u32, MAX_MESSAGE>::new());
    let mut drain = |observer: &mut _, hash: &mut FlightHash, output: &mut Vec<u32, MAX_MESSAGE>| {
        taps.drain(&mut |topic, at, generation, words| {
            hash.publish(topic as u16, generation, at, words);
            PlayObserver::published(observer, topic, at, generation, words);
            if topic == header.output {
                output.clear();
                // There is room for the longest message.
                let _ = output.extend_from_slice(words);
            }
        });
    };
    let fields = <R::Topics as TopicTable>::TOPICS.get(header.output).map_or(&[][..], |info| info.fields);
    let mut deviation = Deviation { tolerance, worst: 0.0, since: None };
    let mut clock = header.start;
    for entry in entries {
        match entry? {
            Entry::Sample { topic, at, words } => {
                outside.publish_words(topic, at, &words).ok_or(GoldenError::Damaged)?;
                // At once, so that samples enter the hash in the order in which they came.
                drain(observer, &mut hash, &mut output);
            }
            Entry::Turn(now) => {
                clock = now;
                for band in [Band::Flight, Band::Background] {
                    observer.band_starts(band, now);
                    flight_loop.run_band(band, now, observer);
                    observer.band_finished(band);
                }
                drain(observer, &mut hash, &mut output);
            }
            Entry::Output(expected) => deviation.add(clock, fields, &expected, &output),
        }
    }
    let verdict = match deviation {
        Deviation { worst: 0.0, .. } if hash.finish() == header.hash => Verdict::Identical,
        Deviation { worst, since: None, .. } => Verdict::WithinTolerance { worst },
        Deviation { worst, since: Some(since), .. } => Verdict::Beyond { worst, since },
    };
    let duration = clock.since(header.start);
    Ok(Report { verdict, hash: hash.finish(), messages: hash.messages(), duration })
}

/// How far the output is from what was recorded.
struct Deviation {
    tolerance: f32,
    worst: f32,
    since: Option<Instant>,
}

impl Deviation {
    /// Compares the numbers in two samples. An output that was never published is empty.
    fn add(&mut self, clock: Instant, info: &'static [FieldInfo], expected: &[u32], output: &[u32]) {
        for leaf in leaves(info) {
            // Rounding changes nothing but real numbers.
            let is_real = matches!(leaf.kind, FieldKind::F32 | FieldKind::F64);
            let number = |words: &[u32]| leaf.kind.value(words).map_or(f32::NAN, |value| value.as_f64() as f32);
            for element in 0..leaf.count {
                let deviation = match (leaf.words(output, element), leaf.words(expected, element)) {
                    (Some(output), Some(expected)) if output == expected => 0.0,
                    (Some(output), Some(expected)) if is_real => {
                        let difference = (number(output) - number(expected)).abs();
                        // Zeros of either sign are other bits, too.
                        if difference.is_nan() { f32::INFINITY } else { difference.max(f32::MIN_POSITIVE) }
                    }
                    _ => f32::INFINITY,
                };
                self.worst = self.worst.max(deviation);
                if deviation > self.tolerance {
                    self.since.get_or_insert(clock);
                }
            }
        }
    }
}
