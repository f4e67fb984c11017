//! The vehicle's end: bytes in, an answer out, the flight loop in between.

use super::frame::Decoder;
use super::protocol::{Bands, Entries, Entry, Log, Refusal, Reply, Request, Stepped, VERSION};
use crate::golden::tables;
use crate::{FlightLoop, InPlace, Observer};
use stampfly_bus::{Activation, Band, PublishWords, Schedule, Taps, TopicTable};
use stampfly_param::{ParameterError, Parameters, parameters};
use stampfly_types::{Duration, Instant};

/// A vehicle that is left alone for this long by its own clock ends the flight: two hundred times what a step may take on a
/// slow line.
pub const SILENCE: Duration = Duration::from_secs(2);

/// A step leads at most so far: what has become due meanwhile is made up for, tick by tick, and nobody waits for a year of it.
const LEAP: Duration = Duration::from_secs(10);

/// And the clock at power-on is at most this: nobody has to think of an instant that overflows.
const LATEST_START: Instant = Instant::from_secs(1 << 40);

/// Room for a question, and for what happens in a step, bytes: twice the longest of the StampFly.
pub const LONGEST: usize = 4096;
/// Room for an answer: the same as a frame.
pub const LONGEST_FRAME: usize = LONGEST + LONGEST / 254 + 64;

/// The conversation so far: what a frame is collected in, and the last answer, which is given again when it was lost.
#[derive(Debug)]
pub struct Line<'m> {
    decoder: Decoder<&'m mut [u8]>,
    log: Log<'m>,
    reply: &'m mut [u8],
    replied: usize,
    /// Sequence of the last question that was answered.
    last: Option<u16>,
    /// When a whole frame came last.
    heard: Option<Instant>,
}

/// Why a flight is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Over {
    /// The computer has said so.
    Ended,
    /// Nobody has said anything for [`SILENCE`].
    Silence,
}

/// What to do with a question.
enum Turn {
    /// The answer is given again.
    Again,
    /// It is new.
    New,
    /// It was not to be expected.
    Odd,
}

impl<'m> Line<'m> {
    /// Nothing was said. The first two need [`LONGEST`] bytes, `reply` [`LONGEST_FRAME`]: with less, longer questions are not
    /// heard, and longer answers are refused.
    pub const fn new(incoming: &'m mut [u8], happened: &'m mut [u8], reply: &'m mut [u8]) -> Self {
        let (decoder, log) = (Decoder::new(incoming), Log::new(happened));
        Self { decoder, log, reply, replied: 0, last: None, heard: None }
    }

    /// The answer to send.
    #[must_use]
    pub fn reply(&self) -> &[u8] {
        self.reply.get(..self.replied).unwrap_or_default()
    }
}

/// What became of a byte before the flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Greeting {
    /// More has to come.
    Incomplete,
    /// There is an answer to send: [`Line::reply`].
    Answered,
    /// There is an answer to send, and the vehicle is to be made, its clock at this instant.
    Starts(Instant),
}

/// Which turn it is for this question.
fn turn(last: Option<u16>, sequence: u16) -> Turn {
    match last {
        Some(last) if last == sequence => Turn::Again,
        Some(last) if last.wrapping_add(1) == sequence => Turn::New,
        _ => Turn::Odd,
    }
}

/// Takes a byte before the flight: greets, and takes parameters into the configuration that will fly. `now` is the
/// vehicle's own clock.
pub fn greet<R: Schedule>(line: &mut Line<'_>, byte: u8, now: Instant, config: &mut dyn Parameters) -> Greeting {
    let Line { decoder, reply, replied, last, heard, .. } = line;
    let Some(body) = decoder.feed(byte) else { return Greeting::Incomplete };
    *heard = Some(now);
    let mut starts = None;
    let request = Request::read(body.kind, body.payload, <R::Topics as TopicTable>::TOPICS);
    let answer = match (request, turn(*last, body.sequence)) {
        (None, _) => Reply::Refused(Refusal::Nonsense),
        (Some(Request::Hello { version, .. }), _) if version != VERSION => Reply::Refused(Refusal::OtherVersion),
        (Some(Request::Hello { tables: theirs, .. }), _) if theirs != tables::<R>() => {
            Reply::Refused(Refusal::OtherTables)
        }
        (Some(Request::Hello { .. }), _) => {
            *last = Some(body.sequence);
            Reply::Taken
        }
        (_, Turn::Again) => return Greeting::Answered,
        (Some(Request::Parameter { name, value }), Turn::New) => {
            *last = Some(body.sequence);
            // They come one by one in any order; which go together is the business of whoever flies it.
            match parameters::find(config, name).and_then(|index| parameters::set_alone(config, index, value)) {
                Ok(()) => Reply::Taken,
                Err(ParameterError::Unknown) => Reply::Refused(Refusal::UnknownParameter),
                Err(_) => Reply::Refused(Refusal::OutOfRange),
            }
        }
        (Some(Request::Start(at)), _) if at > LATEST_START => Reply::Refused(Refusal::Nonsense),
        (Some(Request::Start(at)), Turn::New) => {
            *last = Some(body.sequence);
            starts = Some(at);
            Reply::Taken
        }
        _ => Reply::Refused(Refusal::OutOfOrder),
    };
    *replied = answer.write(reply, body.sequence).unwrap_or_default();
    starts.map_or(Greeting::Answered, Greeting::Starts)
}

/// A vehicle whose world is at the other end of a line.
///
/// It owns the ends of everybody outside, the motors' too: what the vehicle wants its motors to do can leave it on the line
/// and in no other way.
///
/// ```
/// # mod rover { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/flight/common/mod.rs")); }
/// use rover::{Rover, topics::{Bus, Id, TOPICS}}; // the rover of `tests/flight/common`, configured by a gain
/// use core::mem::MaybeUninit;
/// use stampfly_flight::golden::tables;
/// use stampfly_flight::hil::{Bands, Entries, Flight, Greeting, LONGEST, LONGEST_FRAME, Line, Log, Over, Request, greet};
/// use stampfly_flight::{Assembled, hil};
/// use stampfly_types::{Duration, Instant, Message, messages::TofData};
/// # use stampfly_flight::param::{ParameterError, ParameterInfo, Parameters};
/// # struct Nothing;
/// # impl Parameters for Nothing {
/// #     fn describe(&self, _: usize) -> Option<ParameterInfo<'_>> { None }
/// #     fn get(&self, _: usize) -> Option<f32> { None }
/// #     fn set(&mut self, _: usize, _: f32) -> Result<(), ParameterError> { Err(ParameterError::Unknown) }
/// # }
///
/// # fn main() {
/// let (mut incoming, mut happened, mut reply) = ([0; LONGEST], [0; LONGEST], [0; LONGEST_FRAME]);
/// let mut line = Line::new(&mut incoming, &mut happened, &mut reply);
/// let asked = |request: Request, sequence| {
///     let mut wire = [0; 256];
///     let length = request.write(&mut wire, sequence).unwrap();
///     wire[..length].to_vec()
/// };
/// let power_on = Instant::from_millis(5);
/// let hello = Request::Hello { version: hil::VERSION, tables: tables::<Rover>() };
/// let mut greeted = Greeting::Incomplete;
/// for byte in [asked(hello, 1), asked(Request::Start(power_on), 2)].concat() {
///     greeted = greet::<Rover>(&mut line, byte, Instant::ZERO, &mut Nothing);
/// }
/// assert_eq!(greeted, Greeting::Starts(power_on));
///
/// let (mut place, mut bus) = (MaybeUninit::uninit(), Bus::new());
/// let rover = Assembled::in_place(&mut place, &mut bus, None, &0.5, power_on);
/// let mut flight = Flight::<Rover>::new(&mut line, rover, power_on);
/// let (mut memory, now) = ([0; 64], power_on + Duration::from_millis(20));
/// let mut samples = Log::new(&mut memory);
/// let range = TofData { distance: 1.5, valid: true, ..Default::default() };
/// samples.sample(Id::sensor_range as usize, now, &range.to_words());
/// let samples = Entries::new(samples.bytes().unwrap(), &TOPICS);
/// let step = Request::Step { now, bands: Bands { flight: true, background: false }, samples };
/// let answers = asked(step, 3).into_iter().filter(|byte| flight.feed(*byte, || Instant::ZERO)).count();
/// assert_eq!(answers, 1);
/// // An activation of 29 bytes, and the motors' sample, in a frame: `hil::Reply::read` reads it.
/// assert!(flight.reply().len() > 29);
/// assert_eq!(flight.over(Instant::from_secs(3)), Some(Over::Silence));
/// # }
/// ```
pub struct Flight<'l, 'm, 'b, R: Schedule> {
    line: &'l mut Line<'m>,
    vehicle: InPlace<'b, R>,
    /// What the last step led up to.
    clock: Instant,
    over: Option<Over>,
}

impl<'l, 'm, 'b, R: Schedule> Flight<'l, 'm, 'b, R> {
    /// A vehicle at power-on, after [`Greeting::Starts`] with this instant on this line.
    pub const fn new(line: &'l mut Line<'m>, vehicle: InPlace<'b, R>, start: Instant) -> Self {
        Self { line, vehicle, clock: start, over: None }
    }

    /// The answer to send.
    #[must_use]
    pub fn reply(&self) -> &[u8] {
        self.line.reply()
    }

    /// Frames that were refused so far.
    #[must_use]
    pub const fn garbled(&self) -> u32 {
        self.line.decoder.garbled()
    }

    /// Is the flight over, because the computer said so or has said nothing for [`SILENCE`]? Nothing runs any more then.
    /// `now` is the vehicle's own clock.
    pub fn over(&mut self, now: Instant) -> Option<Over> {
        if self.over.is_none() && self.line.heard.is_none_or(|heard| now.since(heard) > SILENCE) {
            self.over = Some(Over::Silence);
        }
        self.over
    }

    /// Takes a byte. Is there an answer to send? `clock` is the vehicle's own: a step is timed with it.
    pub fn feed(&mut self, byte: u8, clock: impl Fn() -> Instant) -> bool {
        let now = clock();
        self.over(now);
        let Self { line: Line { decoder, log, reply, replied, last, heard }, vehicle, clock: before, over } = self;
        let garbled = decoder.garbled();
        let Some(body) = decoder.feed(byte) else { return false };
        let sequence = body.sequence;
        let request = Request::read(body.kind, body.payload, <R::Topics as TopicTable>::TOPICS);
        let answer = match (request, turn(*last, sequence)) {
            (None, _) => Reply::Refused(Refusal::Nonsense),
            (Some(_), _) if *over == Some(Over::Silence) => Reply::Refused(Refusal::Silence),
            (Some(Request::Hello { .. }), _) => Reply::Refused(Refusal::OutOfOrder),
            (_, Turn::Again) => {
                *heard = Some(now);
                return true;
            }
            (Some(Request::Step { now: at, bands, samples }), Turn::New) if over.is_none() => {
                (*last, *heard) = (Some(sequence), Some(now));
                log.clear();
                let leads_on = at >= *before && at.since(*before) <= LEAP;
                let stepped = if leads_on { step(vehicle, log, at, bands, samples) } else { Err(Refusal::Nonsense) };
                if stepped.is_ok() {
                    *before = at;
                }
                match stepped {
                    Ok((next_tick, due)) => match log.bytes() {
                        Some(bytes) => Reply::Stepped(Stepped {
                            next_tick,
                            due,
                            took: clock().since(now),
                            garbled,
                            lost: vehicle.taps.lost(),
                            entries: Entries::new(bytes, <R::Topics as TopicTable>::TOPICS),
                        }),
                        None => Reply::Refused(Refusal::NoRoom),
                    },
                    Err(why) => Reply::Refused(why),
                }
            }
            (Some(Request::End), Turn::New) => {
                (*last, *heard) = (Some(sequence), Some(now));
                *over = Some(Over::Ended);
                Reply::Taken
            }
            _ => Reply::Refused(Refusal::OutOfOrder),
        };
        let written = answer.write(reply, sequence).or_else(|| Reply::Refused(Refusal::NoRoom).write(reply, sequence));
        *replied = written.unwrap_or_default();
        true
    }
}

/// Publishes samples and runs what is due. Returns the next tick, and what is due still.
fn step<R: Schedule>(
    vehicle: &mut InPlace<'_, R>,
    log: &mut Log<'_>,
    now: Instant,
    bands: Bands,
    samples: Entries<'_>,
) -> Result<(Option<Instant>, Bands), Refusal> {
    let InPlace { flight_loop, outside, taps } = vehicle;
    for entry in samples {
        let Ok(Entry::Sample { topic, at, words }) = entry else { return Err(Refusal::Nonsense) };
        if at > now + LEAP {
            return Err(Refusal::Nonsense);
        }
        outside.publish_words(topic, at, &words).ok_or(Refusal::Nonsense)?;
    }
    let mut reporter = Reporter { taps, log, topics: <R::Topics as TopicTable>::TOPICS };
    // What came from outside is known at the other end.
    reporter.taps.drain(&mut |_, _, _, _| {});
    run::<R>(flight_loop, bands, now, &mut reporter);
    let due = |band| flight_loop.is_due(band, now);
    let due = Bands { flight: due(Band::Flight), background: due(Band::Background) };
    Ok((flight_loop.next_tick(), due))
}

/// As any executor that is never late: a pass of the flight band, then all of the background.
fn run<R: Schedule>(flight_loop: &mut FlightLoop<'_, R>, bands: Bands, now: Instant, observer: &mut impl Observer) {
    if bands.flight {
        flight_loop.run_band(Band::Flight, now, observer);
    }
    while bands.background && flight_loop.run_next(Band::Background, now, observer) {}
}

/// Writes down what runs and what it publishes.
struct Reporter<'t, 'l, 'm, T> {
    taps: &'t mut T,
    log: &'l mut Log<'m>,
    topics: &'static [stampfly_bus::TopicInfo],
}

impl<T: Taps> Observer for Reporter<'_, '_, '_, T> {
    fn finished(&mut self, activation: &Activation) {
        let Self { taps, log, topics } = self;
        log.activation(activation.record());
        taps.drain(&mut |topic, at, _, words| {
            if topics.get(topic).is_some_and(|info| !info.is_outside) {
                log.sample(topic, at, words);
            }
        });
    }
}
