//! One flight on virtual time: drivers and pilots as tasks, the flight stack between them, everything witnessed.
//!
//! One thread. Tasks run on the simulator's clock; the runnables run when the [flight loop](stampfly_flight::FlightLoop)
//! says they are due. The same setup gives the same flight, bit for bit.
//!
//! With [`FlightOptions::jitter`] the flight band starts late by a seeded amount and interrupts background activations
//! between reading and publishing, as a preemptive executor on two cores would: generations are skipped, and the log
//! must still replay.

use super::processor::{Here, Processor};
use super::remote::{Remote, RemoteError, There};
use super::{Around, Outside, Surroundings, Witness};
use crate::time::Tasks;
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
pub fn fly<R: Schedule, S: Surroundings<Runnables = R>>(
    config: &R::Config,
    options: &FlightOptions,
    surroundings: &mut S,
    witness: &mut dyn Witness<R>,
    report: &mut dyn FnMut(f32, &'static str),
) -> Ended<S::Outcome> {
    let mut bus = R::Topics::new();
    let Assembled { flight_loop, outside, taps } = Assembled::<R>::new(&mut bus, None, config, options.start);
    let here = Here::new(flight_loop, options.jitter);
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
    mut processor: P,
    outside: Outside<'b, R>,
    mut taps: <R::Topics as TopicTable>::Taps<'b>,
    options: &FlightOptions,
    surroundings: &'b mut S,
    witness: &mut dyn Witness<R>,
    report: &mut dyn FnMut(f32, &'static str),
) -> Result<Ended<S::Outcome>, P::Error> {
    let (start, end) = (options.start, options.start + options.limit);
    let clock = surroundings.clock();
    witness.begins(start);
    let mut tasks = Tasks::new(clock.clone());
    let mut around = surroundings.start(&mut tasks, outside);
    let mut next_report = start;
    loop {
        let deadlines = [tasks.next_deadline(), processor.deadline(clock.now())];
        let Some(next) = deadlines.into_iter().flatten().min() else { break };
        tasks.run_until(next.max(clock.now()));
        let now = clock.now();
        // What came from outside is in the log before the activations that read it.
        drain(&mut taps, &mut processor, &mut around, witness);

        witness.turn(now);
        processor.turn(now, &mut around, witness)?;
        around.show(now);
        drain(&mut taps, &mut processor, &mut around, witness);
        witness.lost(now, taps.lost());
        if let Some(flight_loop) = processor.at_rest() {
            witness.at_rest(now, flight_loop);
        }

        if now >= next_report {
            next_report = now + REPORT_PERIOD;
            let (done, word) = around.progress();
            report(done, word);
        }
        if around.is_over(now) || now >= end {
            break;
        }
    }
    drop(tasks);
    if processor.end(witness) {
        drain(&mut taps, &mut processor, &mut around, witness);
    }
    witness.ends();
    Ok(Ended { outcome: around.finish(), duration: clock.now().since(start), log_lost: taps.lost() })
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
