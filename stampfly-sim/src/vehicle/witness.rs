//! Being told everything that happens in a flight.

use stampfly_bus::Schedule;
use stampfly_flight::{FlightLoop, Observer};
use stampfly_types::Instant;

/// Is told everything that happens in a flight, in order. All of it may be ignored.
///
/// A pair of witnesses is one.
pub trait Witness<R: Schedule>: Observer {
    /// The vehicle is switched on.
    fn begins(&mut self, _start: Instant) {}

    /// The executor is about to look what is due.
    fn turn(&mut self, _clock: Instant) {}

    /// A sample was published.
    fn published(&mut self, _topic: usize, _at: Instant, _generation: u32, _words: &[u32]) {}

    /// The surroundings have a sample for the log: its place in [`Vehicle::BESIDE`](super::Vehicle::BESIDE).
    fn beside(&mut self, _place: usize, _at: Instant, _generation: u32, _words: &[u32]) {}

    /// Nothing is pending, and everything published has been passed on: the moment for a key frame, or to change something.
    fn at_rest(&mut self, _clock: Instant, _flight_loop: &mut FlightLoop<'_, R>) {}

    /// Something of the vehicle's state was replaced from outside, as by a change of parameters: a replay goes on from a key frame.
    fn replaced(&mut self, _clock: Instant) {}

    /// The log's taps have lost so many samples so far.
    fn lost(&mut self, _clock: Instant, _samples: u32) {}

    /// Does somebody want the compact record of the flight, and what is the vehicle's name in there? Asked before the flight.
    fn record_of(&self) -> Option<&'static str> {
        None
    }

    /// The next chunk of that record.
    fn recorded(&mut self, _chunk: &[u8]) {}

    /// The flight is over.
    fn ends(&mut self) {}
}

/// Nothing to be told.
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
