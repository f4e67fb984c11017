//! Observer of all events of a flight.

use stampfly_bus::Schedule;
use stampfly_flight::{FlightLoop, Observer};
use stampfly_types::Instant;

/// Receives all events of a flight in order. Every function does nothing by default.
///
/// A pair of witnesses is a witness: both receive each event.
pub trait Witness<R: Schedule>: Observer {
    /// The vehicle is powered on.
    fn begins(&mut self, _start: Instant) {}

    /// The executor is about to check which activations are due.
    fn turn(&mut self, _clock: Instant) {}

    /// A sample was published.
    fn published(&mut self, _topic: usize, _at: Instant, _generation: u32, _words: &[u32]) {}

    /// A sample of the surroundings for the log; `place` is its index in
    /// [`Vehicle::BESIDE`](super::Vehicle::BESIDE).
    fn beside(&mut self, _place: usize, _at: Instant, _generation: u32, _words: &[u32]) {}

    /// No activation is pending and all published samples have been passed on: a key frame or a
    /// change can be made now.
    fn at_rest(&mut self, _clock: Instant, _flight_loop: &mut FlightLoop<'_, R>) {}

    /// State of the vehicle was replaced from outside, as by a change of parameters. A replay
    /// continues from the next key frame.
    fn replaced(&mut self, _clock: Instant) {}

    /// Total number of samples lost by the log's taps.
    fn lost(&mut self, _clock: Instant, _samples: u32) {}

    /// The vehicle's name in the compact record, if this witness takes the record. Called before
    /// the flight.
    fn record_of(&self) -> Option<&'static str> {
        None
    }

    /// The next chunk of the compact record.
    fn recorded(&mut self, _chunk: &[u8]) {}

    /// The flight is over.
    fn ends(&mut self) {}
}

/// A witness that ignores all events.
impl<R: Schedule> Witness<R> for () {}

impl<R: Schedule, A: Witness<R>, B: Witness<R>> Witness<R> for (A, B) {
    fn begins(&mut self, start: Instant) {
        self.0.begins(start);
        self.1.begins(start);
    }

    fn turn(&mut self, clock: Instant) {
        self.0.turn(clock);
        self.1.turn(clock);
    }

    fn published(&mut self, topic: usize, at: Instant, generation: u32, words: &[u32]) {
        self.0.published(topic, at, generation, words);
        self.1.published(topic, at, generation, words);
    }

    fn beside(&mut self, place: usize, at: Instant, generation: u32, words: &[u32]) {
        self.0.beside(place, at, generation, words);
        self.1.beside(place, at, generation, words);
    }

    fn at_rest(&mut self, clock: Instant, flight_loop: &mut FlightLoop<'_, R>) {
        self.0.at_rest(clock, flight_loop);
        self.1.at_rest(clock, flight_loop);
    }

    fn replaced(&mut self, clock: Instant) {
        self.0.replaced(clock);
        self.1.replaced(clock);
    }

    fn lost(&mut self, clock: Instant, samples: u32) {
        self.0.lost(clock, samples);
        self.1.lost(clock, samples);
    }

    fn record_of(&self) -> Option<&'static str> {
        self.0.record_of().or_else(|| self.1.record_of())
    }

    fn recorded(&mut self, chunk: &[u8]) {
        self.0.recorded(chunk);
        self.1.recorded(chunk);
    }

    fn ends(&mut self) {
        self.0.ends();
        self.1.ends();
    }
}
