//! Processor of a flight's runnables: a local flight loop, or a vehicle at the other end of a line.

use super::jitter::Jitter;
use super::recording::{RecordRing, Recording, Taker};
use super::{Around, Witness};
use serde::Serialize;
use stampfly_bus::{Band, Schedule};
use stampfly_flight::{FlightLoop, Observer, Pending};
use stampfly_types::{Duration, Instant};
use std::convert::Infallible;

/// Interface between the executor and the processor.
pub(super) trait Processor<'b, R: Schedule> {
    /// Reason to abort the flight.
    type Error;

    /// The next instant after `now` at which the processor acts without new samples.
    fn deadline(&self, now: Instant) -> Option<Instant>;

    /// Called for every published sample.
    fn published(&mut self, topic: usize, at: Instant, words: &[u32]);

    /// One executor turn: runs due activations and lets `around` pass on the outputs.
    fn turn(&mut self, now: Instant, around: &mut impl Around, witness: &mut dyn Witness<R>)
    -> Result<(), Self::Error>;

    /// The flight loop if no activation is pending and its state is local, with the observer to
    /// notify of replacements.
    fn at_rest(&mut self) -> Option<(&mut FlightLoop<'b, R>, impl Observer)>;

    /// Ends the flight. Returns true if a pending activation was finished.
    fn end(&mut self, witness: &mut dyn Witness<R>) -> bool;
}

/// A local flight loop with an executor that may be late.
pub(super) struct Here<'b, R: Schedule> {
    flight_loop: FlightLoop<'b, R>,
    jitter: Jitter,
    flight_at: Option<Instant>,
    interrupted: Option<(Instant, Pending)>,
    recording: Option<Recording<'b, R>>,
}

impl<'b, R: Schedule> Here<'b, R> {
    pub(super) fn new(flight_loop: FlightLoop<'b, R>, jitter: Option<u64>) -> Self {
        Self { flight_loop, jitter: Jitter::new(jitter), flight_at: None, interrupted: None, recording: None }
    }

    /// Adds a compact record of the flight under this name.
    pub(super) fn recorded(self, ring: &'b mut RecordRing, taker: (Taker, &'static str)) -> Self
    where
        R: Serialize,
    {
        let recording = Recording::new(ring, self.flight_loop.heads(), taker);
        Self { recording: Some(recording), ..self }
    }
}

impl<'b, R: Schedule> Processor<'b, R> for Here<'b, R> {
    type Error = Infallible;

    fn deadline(&self, now: Instant) -> Option<Instant> {
        let deadlines = [
            // A past tick is already waiting for the delayed executor.
            self.flight_loop.next_tick().filter(|tick| *tick > now),
            // A past start is waiting for a stalled processor.
            self.flight_at.filter(|at| *at > now),
            self.interrupted.as_ref().map(|(at, _)| *at),
        ];
        deadlines.into_iter().flatten().min()
    }

    fn published(&mut self, _: usize, _: Instant, _: &[u32]) {}

    fn turn(&mut self, now: Instant, around: &mut impl Around, witness: &mut dyn Witness<R>) -> Result<(), Infallible> {
        let Self { flight_loop, jitter, flight_at, interrupted, recording } = self;
        // The compact record observes activations together with the witness.
        let outer = witness;
        let mut observers = (recording.as_ref().map(Recording::watching), &mut *outer);
        let witness = &mut observers;
        let held_up = around.is_held_up(Band::Flight, now);
        // The delay is drawn once per due pass, not at every turn.
        if flight_at.is_none() && flight_loop.is_due(Band::Flight, now) {
            *flight_at = Some(now + jitter.flight());
        }
        if !held_up && flight_at.is_some_and(|at| at <= now) {
            *flight_at = None;
            flight_loop.run_band(Band::Flight, now, witness);
            around.drive(now);
        }
        match interrupted.take() {
            Some((at, pending)) if at <= now => flight_loop.finish(pending, witness),
            Some(pending) => *interrupted = Some(pending),
            None if around.is_held_up(Band::Background, now) => {}
            None => {
                while let Some(pending) = flight_loop.start_next(Band::Background, now, witness) {
                    let takes = jitter.background();
                    // The activation has read its inputs; it publishes when the delay is over, with
                    // newer samples on the bus by then.
                    if takes > Duration::ZERO {
                        *interrupted = Some((now + takes, pending));
                        break;
                    }
                    flight_loop.finish(pending, witness);
                }
            }
        }
        if let Some(recording) = recording {
            recording.take(interrupted.is_none().then_some(flight_loop));
            match recording.taker() {
                Taker::Witness => recording.pass_on(&mut |chunk| outer.recorded(chunk)),
                Taker::Around => around.stream(now, recording.chunks()),
            }
        }
        Ok(())
    }

    fn at_rest(&mut self) -> Option<(&mut FlightLoop<'b, R>, impl Observer)> {
        let Self { flight_loop, recording, interrupted, .. } = self;
        interrupted.is_none().then(|| (flight_loop, recording.as_ref().map(Recording::watching)))
    }

    fn end(&mut self, witness: &mut dyn Witness<R>) -> bool {
        let pending = self.interrupted.take();
        let was_pending = pending.map(|(_, pending)| self.flight_loop.finish(pending, witness)).is_some();
        if let Some(recording) = &mut self.recording {
            recording.end(&mut |chunk| witness.recorded(chunk));
        }
        was_pending
    }
}
