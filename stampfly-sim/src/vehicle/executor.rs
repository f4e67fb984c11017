//! Runs one flight on virtual time: drivers and pilots as tasks, the flight stack as runnables, all
//! events reported to a witness.
//!
//! Single-threaded. Tasks run on the simulator's clock; the [flight
//! loop](stampfly_flight::FlightLoop) determines when runnables are due. The same setup gives the
//! same flight bit for bit.
//!
//! With [`FlightOptions::jitter`] the flight band starts late by a seeded delay and interrupts
//! background activations between reading and publishing, as a preemptive executor on two cores
//! does. Readers then skip generations, and the log must still replay.

use super::processor::{Here, Processor};
use super::recording::{RecordRing, Taker};
use super::remote::{Remote, RemoteError, There};
use super::{Around, Outside, Surroundings, Witness};
use crate::time::{Clock, Tasks};
use serde::Serialize;
use stampfly_bus::{Schedule, Taps, TopicTable};
use stampfly_flight::Assembled;
use stampfly_types::{Duration, Instant};

/// Options of the executor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlightOptions {
    /// Time shown by the clock at power-on.
    pub start: Instant,
    /// Longest duration; the flight is aborted after it.
    pub limit: Duration,
    /// Seed of the executor's delays; `None` for an executor that is never late.
    pub jitter: Option<u64>,
}

/// Result of a flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ended<O> {
    /// Outcome, as the surroundings determine it.
    pub outcome: O,
    /// Simulated duration.
    pub duration: Duration,
    /// Samples lost by the log's taps.
    pub log_lost: u32,
}

/// Simulated time between two calls of `report`.
const REPORT_PERIOD: Duration = Duration::from_millis(100);

/// Flies until the surroundings report the end or the limit is reached. Calls `report` with the
/// progress ten times per simulated second.
pub fn fly<R: Schedule + Serialize, S: Surroundings<Runnables = R>>(
    config: &R::Config,
    options: &FlightOptions,
    surroundings: &mut S,
    witness: &mut dyn Witness<R>,
    report: &mut dyn FnMut(f32, &'static str),
) -> Ended<S::Outcome> {
    let taker = match (witness.record_of(), surroundings.record_of()) {
        (Some(name), _) => Some((Taker::Witness, name)),
        (None, name) => name.map(|name| (Taker::Around, name)),
    };
    let mut ring = taker.map(|taker| (Box::new(RecordRing::new()), taker));
    let mut bus = R::Topics::new();
    let Assembled { flight_loop, outside, taps } = Assembled::<R>::new(&mut bus, None, config, options.start);
    let mut here = Here::new(flight_loop, options.jitter);
    if let Some((ring, taker)) = &mut ring {
        here = here.recorded(ring, *taker);
    }
    match fly_on(here, outside, taps, options, surroundings, witness, report) {
        Ok(ended) => ended,
        Err(never) => match never {},
    }
}

/// As [`fly`], with the runnables on a vehicle at the other end of a line, to which the connection
/// has been [opened](Remote::greet). The flight is the same bit for bit if both processors compute
/// the same.
///
/// # Errors
/// If the vehicle refuses a request or the connection is lost; the flight is aborted. Also with
/// [`FlightOptions::jitter`], which only the local executor offers.
pub fn fly_remote<R: Schedule, S: Surroundings<Runnables = R>>(
    config: &R::Config,
    options: &FlightOptions,
    surroundings: &mut S,
    remote: &mut Remote<'_>,
    witness: &mut dyn Witness<R>,
    report: &mut dyn FnMut(f32, &'static str),
) -> Result<Ended<S::Outcome>, RemoteError> {
    // The remote vehicle has an executor of its own.
    if options.jitter.is_some() {
        return Err(RemoteError::NotOffered("an executor that is late"));
    }
    let mut bus = R::Topics::new();
    let Assembled { flight_loop, outside, taps } = Assembled::<R>::new(&mut bus, None, config, options.start);
    let there = There::start(remote, flight_loop, options.start)?;
    let ended = fly_on(there, outside, taps, options, surroundings, witness, report)?;
    remote.end()?;
    Ok(ended)
}

/// Flies with this processor of the runnables.
fn fly_on<'b, R: Schedule, S: Surroundings<Runnables = R>, P: Processor<'b, R>>(
    processor: P,
    outside: Outside<'b, R>,
    taps: <R::Topics as TopicTable>::Taps<'b>,
    options: &FlightOptions,
    surroundings: &'b mut S,
    witness: &mut dyn Witness<R>,
    report: &mut dyn FnMut(f32, &'static str),
) -> Result<Ended<S::Outcome>, P::Error> {
    let mut turns = Turns::begin(processor, outside, taps, options, surroundings, witness);
    let mut next_report = options.start;
    while turns.next(witness)? {
        let now = turns.clock.now();
        if now >= next_report {
            next_report = now + REPORT_PERIOD;
            let (done, word) = turns.around.progress();
            report(done, word);
        }
    }
    Ok(turns.end(witness))
}

/// A flight in this process, advanced turn by turn: for a caller that cannot block until its end,
/// such as a page in a browser or a game loop.
///
/// ```no_run
/// use stampfly_bus::{Schedule, TopicTable};
/// use stampfly_sim::vehicle::{FlightOptions, Flying, Surroundings};
/// use stampfly_types::{Duration, Instant};
///
/// fn two_halves<S: Surroundings>(config: &<S::Runnables as Schedule>::Config, around: &mut S, options: &FlightOptions) {
///     let mut bus = <S::Runnables as Schedule>::Topics::new();
///     let mut flying = Flying::begin(&mut bus, config, options, around, &mut ());
///     flying.go_on(options.start + Duration::from_secs(1), &mut ());
///     flying.go_on(options.start + options.limit, &mut ());
///     println!("{:.1} s", flying.end(&mut ()).duration.seconds());
/// }
/// ```
pub struct Flying<'b, R: Schedule, S: Surroundings<Runnables = R> + 'b>(Turns<'b, R, S, Here<'b, R>>);

impl<'b, R: Schedule, S: Surroundings<Runnables = R>> Flying<'b, R, S> {
    /// Powers the vehicle on.
    pub fn begin(
        bus: &'b mut R::Topics,
        config: &R::Config,
        options: &FlightOptions,
        surroundings: &'b mut S,
        witness: &mut dyn Witness<R>,
    ) -> Self {
        let Assembled { flight_loop, outside, taps } = Assembled::<R>::new(bus, None, config, options.start);
        let here = Here::new(flight_loop, options.jitter);
        Self(Turns::begin(here, outside, taps, options, surroundings, witness))
    }

    /// Advances up to `until`. Returns false when the flight is over.
    pub fn go_on(&mut self, until: Instant, witness: &mut dyn Witness<R>) -> bool {
        while !self.0.is_over && self.0.clock.now() < until {
            match self.0.next(witness) {
                Ok(_) => {}
                Err(never) => match never {},
            }
        }
        !self.0.is_over
    }

    /// The simulated time.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.0.clock.now()
    }

    /// Ends the flight.
    pub fn end(self, witness: &mut dyn Witness<R>) -> Ended<S::Outcome> {
        self.0.end(witness)
    }
}

/// State of a flight between two turns of the executor.
struct Turns<'b, R: Schedule, S: Surroundings<Runnables = R> + 'b, P: Processor<'b, R>> {
    processor: P,
    taps: <R::Topics as TopicTable>::Taps<'b>,
    tasks: Tasks<'b>,
    around: S::Around<'b>,
    clock: Clock,
    start: Instant,
    limit: Instant,
    is_over: bool,
}

impl<'b, R: Schedule, S: Surroundings<Runnables = R>, P: Processor<'b, R>> Turns<'b, R, S, P> {
    fn begin(
        processor: P,
        outside: Outside<'b, R>,
        taps: <R::Topics as TopicTable>::Taps<'b>,
        options: &FlightOptions,
        surroundings: &'b mut S,
        witness: &mut dyn Witness<R>,
    ) -> Self {
        let (start, limit) = (options.start, options.start + options.limit);
        let clock = surroundings.clock();
        witness.begins(start);
        let mut tasks = Tasks::new(clock.clone());
        let around = surroundings.start(&mut tasks, outside);
        Self { processor, taps, tasks, around, clock, start, limit, is_over: false }
    }

    /// One turn of the executor. Returns false when the flight is over.
    fn next(&mut self, witness: &mut dyn Witness<R>) -> Result<bool, P::Error> {
        let Self { processor, taps, tasks, around, clock, .. } = self;
        let deadlines = [tasks.next_deadline(), processor.deadline(clock.now())];
        let Some(next) = deadlines.into_iter().flatten().min() else {
            self.is_over = true;
            return Ok(false);
        };
        // A deadline in the past belongs to a delayed executor: time does not go back.
        tasks.run_until(next.max(clock.now()));
        let now = clock.now();
        // Samples from outside reach the log before the activations that read them.
        drain(taps, processor, around, witness);

        witness.turn(now);
        processor.turn(now, around, witness)?;
        around.show(now);
        drain(taps, processor, around, witness);
        witness.lost(now, taps.lost());
        // Changes from outside go in before the key frame, which then contains them.
        if let Some((flight_loop, mut record)) = processor.at_rest() {
            if around.tend(flight_loop, &mut record) {
                witness.replaced(now);
            }
            witness.at_rest(now, flight_loop);
        }
        self.is_over = self.around.is_over(now) || now >= self.limit;
        Ok(!self.is_over)
    }

    fn end(self, witness: &mut dyn Witness<R>) -> Ended<S::Outcome> {
        let Self { mut processor, mut taps, tasks, mut around, clock, start, .. } = self;
        // Drivers and pilots stop first, so that nothing is published after the last turn.
        drop(tasks);
        if processor.end(witness) {
            drain(&mut taps, &mut processor, &mut around, witness);
        }
        witness.ends();
        Ended { outcome: around.finish(), duration: clock.now().since(start), log_lost: taps.lost() }
    }
}

/// Passes published samples to the witness, the processor and the surroundings.
fn drain<'b, R: Schedule>(
    taps: &mut impl Taps,
    processor: &mut impl Processor<'b, R>,
    around: &mut impl Around,
    witness: &mut dyn Witness<R>,
) {
    taps.drain(&mut |topic, at, generation, words| {
        witness.published(topic, at, generation, words);
        processor.published(topic, at, words);
        around.published(topic, at, words);
    });
    around.beside(&mut |place, at, generation, words| witness.beside(place, at, generation, words));
}
