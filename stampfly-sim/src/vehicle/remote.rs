//! Hardware in the loop, the computer's end: a vehicle at the other end of a line. The vehicle's
//! end is [`stampfly_flight::hil`].
//!
//! The local bus mirrors the vehicle's: samples from outside are sent to it, samples published by
//! its runnables are received, and each reader has the same position as on the vehicle. Pilot,
//! judge, log and report therefore work as with a local flight.

use super::processor::Processor;
use super::{Around, Witness};
use stampfly_bus::{Band, Schedule, TopicTable, Trigger};
use stampfly_flight::golden::tables;
use stampfly_flight::hil::{
    Bands, Decoder, Entries, Entry, LONGEST, LONGEST_FRAME, Log, Refusal, Reply, Request, VERSION,
};
use stampfly_flight::{FlightLoop, Observer};
use stampfly_types::Instant;
use std::fmt;
use std::io;
use std::time::{Duration, Instant as Wall};

/// Byte stream to and from a vehicle.
pub trait Port {
    /// Sends bytes.
    ///
    /// # Errors
    /// If the line is gone.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Waits up to `patience` for bytes and returns how many were received; 0 on timeout.
    ///
    /// # Errors
    /// If the line is gone.
    fn receive(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize>;
}

/// Settings of the conversation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Time until a request is repeated, doubled with each repetition. Default 250 ms. A vehicle
    /// without requests for [`SILENCE`](stampfly_flight::hil::SILENCE) gives up.
    pub patience: Duration,
    /// Number of attempts after which the vehicle counts as lost. Default 4.
    pub tries: u32,
    /// Request each step at its time on the wall clock instead of as soon as possible. Default off.
    pub real_time: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { patience: Duration::from_millis(250), tries: 4, real_time: false }
    }
}

/// Why a remote flight failed.
#[derive(Debug)]
#[non_exhaustive]
pub enum RemoteError {
    /// Not supported remotely.
    NotOffered(&'static str),
    /// The line failed.
    Port(io::Error),
    /// All attempts timed out.
    NoAnswer,
    /// The vehicle refused the request.
    Refused(Refusal),
    /// The vehicle refused a parameter.
    Parameter(String, Refusal),
    /// The answer is invalid.
    Nonsense,
}

impl fmt::Display for RemoteError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotOffered(what) => write!(f, "not offered: {what}"),
            Self::Port(error) => write!(f, "the line to the vehicle is gone: {error}"),
            Self::NoAnswer => f.write_str("the vehicle does not answer"),
            Self::Refused(why) => why.fmt(f),
            Self::Parameter(name, why) => write!(f, "{name}: {why}"),
            Self::Nonsense => f.write_str("the vehicle has answered what cannot be"),
        }
    }
}

impl std::error::Error for RemoteError {}

impl From<io::Error> for RemoteError {
    fn from(error: io::Error) -> Self {
        Self::Port(error)
    }
}

/// Statistics of the conversation.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Figures {
    /// Time from request to answer of each step.
    pub round_trips: Vec<Duration>,
    /// Delay of each step's answer after its wall-clock time; empty unless in real time.
    pub behind: Vec<Duration>,
    /// Longest step by the vehicle's clock.
    pub longest: Duration,
    /// Sum of all steps.
    pub total: Duration,
    /// Repeated requests.
    pub again: u64,
    /// Corrupted frames received here and by the vehicle.
    pub garbled: [u32; 2],
    /// Samples lost by the vehicle's log; they are missing in the local log, too.
    pub lost: u32,
}

/// Connection to a remote vehicle: [greet](Self::greet) it, set its parameters, and hand it to
/// [`fly_remote`](super::fly_remote). `stampfly_host::hil::fly` does all of this.
pub struct Remote<'p> {
    port: &'p mut dyn Port,
    settings: Settings,
    decoder: Decoder<Vec<u8>>,
    sequence: u16,
    question: Vec<u8>,
    /// Received bytes not yet decoded.
    received: Vec<u8>,
    figures: Figures,
}

impl<'p> Remote<'p> {
    /// A connection; nothing is sent yet.
    pub fn new(port: &'p mut dyn Port, settings: Settings) -> Self {
        Self {
            port,
            settings,
            decoder: Decoder::new(vec![0; LONGEST + 64]),
            sequence: 0,
            question: vec![0; LONGEST_FRAME],
            received: Vec::new(),
            figures: Figures::default(),
        }
    }

    /// Statistics so far.
    #[must_use]
    pub fn figures(&self) -> &Figures {
        &self.figures
    }

    /// Sends a request, with repetitions, and hands the answer to `take`.
    fn ask<T>(
        &mut self,
        request: &Request<'_>,
        topics: &'static [stampfly_bus::TopicInfo],
        take: impl FnOnce(Reply<'_>) -> Result<T, RemoteError>,
    ) -> Result<T, RemoteError> {
        self.sequence = self.sequence.wrapping_add(1);
        let length = request.write(&mut self.question, self.sequence).ok_or(RemoteError::Nonsense)?;
        let mut patience = self.settings.patience;
        for attempt in 0..self.settings.tries {
            self.figures.again += u64::from(attempt > 0);
            self.port.send(&self.question[..length])?;
            let asked = Wall::now();
            while asked.elapsed() < patience {
                if self.received.is_empty() {
                    let mut buffer = [0; 4096];
                    let left = patience.saturating_sub(asked.elapsed());
                    let count = self.port.receive(&mut buffer, left)?;
                    self.received.extend_from_slice(&buffer[..count]);
                }
                // Bytes after the answer stay in the buffer: they may belong to the next one.
                for (place, byte) in self.received.iter().enumerate() {
                    let Some(body) = self.decoder.feed(*byte) else { continue };
                    // A repeated request may be answered twice; the sequence number identifies the
                    // second answer.
                    if body.sequence != self.sequence {
                        continue;
                    }
                    let reply = Reply::read(body.kind, body.payload, topics).ok_or(RemoteError::Nonsense)?;
                    let outcome = take(reply);
                    self.received.drain(..=place);
                    self.figures.garbled[0] = self.decoder.garbled();
                    return outcome;
                }
                self.received.clear();
            }
            // Back-off: a slow line would otherwise be loaded with repetitions.
            patience *= 2;
        }
        Err(RemoteError::NoAnswer)
    }

    /// Sends a request that is either carried out or refused.
    fn want(&mut self, request: &Request<'_>) -> Result<(), RemoteError> {
        self.ask(request, &[], |reply| match reply {
            Reply::Taken => Ok(()),
            Reply::Refused(why) => Err(RemoteError::Refused(why)),
            Reply::Stepped(_) => Err(RemoteError::Nonsense),
        })
    }

    /// Opens the connection and checks that the vehicle has the tables of `R`.
    ///
    /// # Errors
    /// If the vehicle does not answer or has other tables.
    pub fn greet<R: Schedule>(&mut self) -> Result<(), RemoteError> {
        self.want(&Request::Hello { version: VERSION, tables: tables::<R>() })
    }

    /// Sets a parameter before the flight.
    ///
    /// # Errors
    /// If the vehicle refuses it or the connection is lost.
    pub fn parameter(&mut self, name: &str, value: f32) -> Result<(), RemoteError> {
        self.want(&Request::Parameter { name, value }).map_err(|error| match error {
            RemoteError::Refused(why) => RemoteError::Parameter(name.into(), why),
            other => other,
        })
    }

    /// Ends the flight.
    pub(super) fn end(&mut self) -> Result<(), RemoteError> {
        match self.want(&Request::End) {
            // The vehicle has left the conversation and cannot repeat a lost answer.
            Err(RemoteError::NoAnswer | RemoteError::Port(_)) => Ok(()),
            other => other,
        }
    }
}

/// A remote vehicle in flight and the mirror of its bus.
pub(super) struct There<'r, 'p, 'b, R: Schedule> {
    remote: &'r mut Remote<'p>,
    mirror: FlightLoop<'b, R>,
    /// Samples not yet sent.
    pending: Vec<u8>,
    /// A pending sample is on a topic that triggers an activation.
    wakes: bool,
    next_tick: Option<Instant>,
    due: Bands,
    /// Start of the flight by both clocks.
    began: (Instant, Wall),
}

impl<'r, 'p, 'b, R: Schedule> There<'r, 'p, 'b, R> {
    /// Powers the vehicle on.
    pub(super) fn start(
        remote: &'r mut Remote<'p>,
        mirror: FlightLoop<'b, R>,
        at: Instant,
    ) -> Result<Self, RemoteError> {
        remote.want(&Request::Start(at))?;
        let next_tick = mirror.next_tick();
        let (pending, due) = (Vec::new(), Bands::default());
        Ok(Self { remote, mirror, pending, wakes: false, next_tick, due, began: (at, Wall::now()) })
    }

    /// True if the vehicle has something to do in these bands.
    fn is_needed(&self, now: Instant, bands: Bands) -> bool {
        let may_be = self.wakes || self.next_tick.is_some_and(|tick| tick <= now);
        // A new sample or tick may concern either band.
        let may_run = bands.flight || bands.background;
        may_be && may_run || self.due.flight && bands.flight || self.due.background && bands.background
    }

    /// Requests one step from the vehicle and applies the results to the mirror.
    fn step(&mut self, now: Instant, bands: Bands, witness: &mut dyn Witness<R>) -> Result<(), RemoteError> {
        let Self { remote, mirror, pending, wakes, next_tick, due, began: (start, wall) } = self;
        let planned = *wall + Duration::from_micros(now.since(*start).as_micros());
        let real_time = remote.settings.real_time;
        if real_time {
            std::thread::sleep(planned.saturating_duration_since(Wall::now()));
        }
        let topics = <R::Topics as TopicTable>::TOPICS;
        let request = Request::Step { now, bands, samples: Entries::new(pending, topics) };
        let asked = Wall::now();
        let (took, garbled, lost) = remote.ask(&request, topics, |reply| {
            let stepped = match reply {
                Reply::Stepped(stepped) => stepped,
                Reply::Refused(why) => return Err(RemoteError::Refused(why)),
                Reply::Taken => return Err(RemoteError::Nonsense),
            };
            (*next_tick, *due) = (stepped.next_tick, stepped.due);
            for entry in stepped.entries {
                match entry.map_err(|_| RemoteError::Nonsense)? {
                    Entry::Activation(record) => {
                        let index = usize::from(record.index);
                        let activation = mirror.follow(record);
                        // The tables were compared when greeting, so this is a corrupt answer.
                        if index >= R::ACTIVATIONS.len() || activation.is_missing_input() {
                            return Err(RemoteError::Nonsense);
                        }
                        // The three events of an activation come together, because its run time
                        // here is zero.
                        witness.starts(index);
                        witness.has_read(&activation);
                        witness.finished(&activation);
                    }
                    Entry::Sample { topic, at, words } => {
                        mirror.publish_words(topic, at, &words).ok_or(RemoteError::Nonsense)?;
                    }
                }
            }
            Ok((stepped.took, stepped.garbled, stepped.lost))
        })?;
        let figures = &mut remote.figures;
        figures.round_trips.push(asked.elapsed());
        if real_time {
            figures.behind.push(Wall::now().saturating_duration_since(planned));
        }
        let took = Duration::from_micros(took.as_micros());
        figures.longest = figures.longest.max(took);
        figures.total += took;
        (figures.garbled[1], figures.lost) = (garbled, lost);
        pending.clear();
        *wakes = false;
        Ok(())
    }
}

/// True if a sample on this topic triggers an activation.
fn activates<R: Schedule>(topic: usize) -> bool {
    R::ACTIVATIONS.iter().any(|line| matches!(line.trigger, Trigger::On(topics) if topics.contains(&topic)))
}

impl<'b, R: Schedule> Processor<'b, R> for There<'_, '_, 'b, R> {
    type Error = RemoteError;

    fn deadline(&self, now: Instant) -> Option<Instant> {
        self.next_tick.filter(|tick| *tick > now)
    }

    fn published(&mut self, topic: usize, at: Instant, words: &[u32]) {
        if <R::Topics as TopicTable>::TOPICS.get(topic).is_some_and(|info| info.is_outside) {
            let mut memory = [0; 1024];
            let mut log = Log::new(&mut memory);
            log.sample(topic, at, words);
            self.pending.extend_from_slice(log.bytes().unwrap_or_default());
            self.wakes |= activates::<R>(topic);
        }
    }

    fn turn(
        &mut self,
        now: Instant,
        around: &mut impl Around,
        witness: &mut dyn Witness<R>,
    ) -> Result<(), RemoteError> {
        let flight = !around.is_held_up(Band::Flight, now);
        let bands = Bands { flight, background: !around.is_held_up(Band::Background, now) };
        // Samples accumulated while the processor is stalled must fit into one request.
        if self.is_needed(now, bands) || self.pending.len() > LONGEST / 2 {
            self.step(now, bands, witness)?;
            around.drive(now);
        }
        Ok(())
    }

    fn at_rest(&mut self) -> Option<(&mut FlightLoop<'b, R>, impl Observer)> {
        None::<(_, ())>
    }

    fn end(&mut self, _: &mut dyn Witness<R>) -> bool {
        false
    }
}
