//! One flight on virtual time: drivers and pilots as tasks, the flight stack between them, everything witnessed.
//!
//! One thread. Tasks run on the simulator's clock; the runnables run when the [flight loop](stampfly_flight::FlightLoop)
//! says they are due. The same setup gives the same flight, bit for bit.
//!
//! With [`FlightOptions::jitter`] the flight band starts late by a seeded amount and interrupts background activations
//! between reading and publishing, as a preemptive executor on two cores would: generations are skipped, and the log
//! must still replay.

use super::processor::{Here, Processor};
use super::recording::{RecordRing, Taker};
use super::remote::{Remote, RemoteError, There};
use super::{Around, Outside, Surroundings, Witness};
use crate::time::{Clock, Tasks};
use serde::Serialize;
use stampfly_bus::{Schedule, Taps, TopicTable};
use stampfly_flight::Assembled;
use stampfly_types::{Duration, Instant};

/// How a flight is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlightOptions {
    /// What the clock shows at power-on.
    pub start: Instant,
    /// The flight is broken off after this long.
    pub limit: Duration,
    /// Seed of the executor's delays; `None` for an executor that is never late.
    pub jitter: Option<u64>,
}

/// How a flight ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ended<O> {
    /// What the surroundings say of it.
    pub outcome: O,
    /// Simulated time.
    pub duration: Duration,
    /// Samples that the log's taps missed.
    pub log_lost: u32,
}

/// Time between two calls of `report`.
const REPORT_PERIOD: Duration = Duration::from_millis(100);

/// Flies until the surroundings say that it is over, or the limit is reached. `report` is called about ten times a
/// simulated second with the progress.
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

/// As [`fly`], with the runnables on a vehicle at the other end of a line, which has been
/// [greeted](Remote::greet). The same flight bit for bit, if both compute alike.
///
/// # Errors
/// When the vehicle refuses something or is lost; the flight is broken off. And for [`FlightOptions::jitter`], which is
/// about an executor here.
pub fn fly_remote<R: Schedule, S: Surroundings<Runnables = R>>(
    config: &R::Config,
    options: &FlightOptions,
    surroundings: &mut S,
    remote: &mut Remote<'_>,
    witness: &mut dyn Witness<R>,
    report: &mut dyn FnMut(f32, &'static str),
) -> Result<Ended<S::Outcome>, RemoteError> {
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

/// Flies on whatever runs the runnables.
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

/// A flight in this process, turn by turn, for a caller that cannot wait for its end: a page in a browser, a game's loop.
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
    /// Switches the vehicle on.
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

    /// Flies up to then. Is there more to fly?
    pub fn go_on(&mut self, until: Instant, witness: &mut dyn Witness<R>) -> bool {
        while !self.0.is_over && self.0.clock.now() < until {
            match self.0.next(witness) {
                Ok(_) => {}
                Err(never) => match never {},
            }
        }
        !self.0.is_over
    }

    /// What the clock shows.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.0.clock.now()
    }

    /// Ends the flight.
    pub fn end(self, witness: &mut dyn Witness<R>) -> Ended<S::Outcome> {
        self.0.end(witness)
    }
}

/// A flight, turn by turn.
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

    /// One turn of the executor. Is there another?
    fn next(&mut self, witness: &mut dyn Witness<R>) -> Result<bool, P::Error> {
        let Self { processor, taps, tasks, around, clock, .. } = self;
        let deadlines = [tasks.next_deadline(), processor.deadline(clock.now())];
        let Some(next) = deadlines.into_iter().flatten().min() else {
            self.is_over = true;
            return Ok(false);
        };
        tasks.run_until(next.max(clock.now()));
        let now = clock.now();
        // What came from outside is in the log before the activations that read it.
        drain(taps, processor, around, witness);

        witness.turn(now);
        processor.turn(now, around, witness)?;
        around.show(now);
        drain(taps, processor, around, witness);
        witness.lost(now, taps.lost());
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
        drop(tasks);
        if processor.end(witness) {
            drain(&mut taps, &mut processor, &mut around, witness);
        }
        witness.ends();
        Ended { outcome: around.finish(), duration: clock.now().since(start), log_lost: taps.lost() }
    }
}

/// Passes on what was published.
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
