//! One flight on virtual time: drivers and pilots as tasks, the flight stack between them, everything witnessed.
//!
//! One thread. Tasks run on the simulator's clock; the runnables run when the [flight loop](stampfly_flight::FlightLoop)
//! says they are due. The same setup gives the same flight, bit for bit.
//!
//! With [`FlightOptions::jitter`] the flight band starts late by a seeded amount and interrupts background activations
//! between reading and publishing, as a preemptive executor on two cores would: generations are skipped, and the log
//! must still replay.

use super::jitter::Jitter;
use super::{Around, Surroundings, Witness};
use crate::time::Tasks;
use stampfly_bus::{Band, Schedule, Taps, TopicTable};
use stampfly_flight::{Assembled, Pending};
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
    let (start, end) = (options.start, options.start + options.limit);
    let clock = surroundings.clock();
    let mut bus = R::Topics::new();
    let Assembled { mut flight_loop, outside, mut taps } = Assembled::<R>::new(&mut bus, None, config, start);
    witness.begins(start);
    let mut tasks = Tasks::new(clock.clone());
    let mut around = surroundings.start(&mut tasks, outside);

    let mut jitter = Jitter::new(options.jitter);
    let mut flight_at: Option<Instant> = None;
    let mut interrupted: Option<(Instant, Pending)> = None;
    let mut next_report = start;
    loop {
        let deadlines = [
            tasks.next_deadline(),
            // A tick that has passed is waiting for an executor that is late.
            flight_loop.next_tick().filter(|tick| *tick > clock.now()),
            // One that has passed waits for a processor that is held up.
            flight_at.filter(|at| *at > clock.now()),
            interrupted.as_ref().map(|(at, _)| *at),
        ];
        let Some(next) = deadlines.into_iter().flatten().min() else { break };
        tasks.run_until(next.max(clock.now()));
        let now = clock.now();
        // What came from outside is in the log before the activations that read it.
        drain(&mut taps, &mut around, witness);

        witness.turn(now);
        let held_up = around.is_held_up(Band::Flight, now);
        if flight_at.is_none() && flight_loop.is_due(Band::Flight, now) {
            flight_at = Some(now + jitter.flight());
        }
        if !held_up && flight_at.is_some_and(|at| at <= now) {
            flight_at = None;
            flight_loop.run_band(Band::Flight, now, witness);
            around.drive(now);
        }
        match interrupted.take() {
            Some((at, pending)) if at <= now => flight_loop.finish(pending, witness),
            Some(pending) => interrupted = Some(pending),
            None if around.is_held_up(Band::Background, now) => {}
            None => {
                while let Some(pending) = flight_loop.start_next(Band::Background, now, witness) {
                    let takes = jitter.background();
                    if takes > Duration::ZERO {
                        interrupted = Some((now + takes, pending));
                        break;
                    }
                    flight_loop.finish(pending, witness);
                }
            }
        }
        around.show(now);
        drain(&mut taps, &mut around, witness);
        witness.lost(now, taps.lost());
        if interrupted.is_none() {
            witness.at_rest(now, &flight_loop);
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
    if let Some((_, pending)) = interrupted {
        flight_loop.finish(pending, witness);
        drain(&mut taps, &mut around, witness);
    }
    witness.ends();
    Ended { outcome: around.finish(), duration: clock.now().since(start), log_lost: taps.lost() }
}

/// Passes on what was published.
fn drain<R: Schedule>(taps: &mut impl Taps, around: &mut impl Around, witness: &mut dyn Witness<R>) {
    taps.drain(&mut |topic, at, generation, words| {
        witness.published(topic, at, generation, words);
        around.published(topic, at, words);
    });
    around.beside(&mut |place, at, generation, words| witness.beside(place, at, generation, words));
}
