//! Surroundings without a world, for a vehicle whose dynamics are one of its own components
//! (software in the loop).
//!
//! Such a vehicle needs only a driver, and its log contains all results: implement [`Script`] and
//! use [`Scripted`] as the vehicle's surroundings. A vehicle with sensors and a plant needs
//! surroundings of its own.

use super::{Around, Outside, Surroundings};
use crate::time::{Clock, Tasks};
use stampfly_bus::Schedule;
use stampfly_flight::newest::message;
use stampfly_types::{Instant, Message};

/// Driver, length and judge of a flight.
pub trait Script: Clone {
    /// The vehicle's runnables.
    type Runnables: Schedule;
    /// A line of the vehicle's log.
    type Line: Message;
    /// Result of a flight.
    type Outcome;
    /// Topic of the log.
    const LOG: usize;

    /// Starts the tasks that drive the vehicle, and gives each the bus ends that it owns. The clock
    /// starts at zero.
    fn start<'a>(&'a self, clock: &Clock, tasks: &mut Tasks<'a>, outside: Outside<'a, Self::Runnables>);

    /// Number of log lines after which the flight is over.
    fn length(&self) -> usize;

    /// True if an external program has ended the flight. Never by default.
    fn is_ended(&self) -> bool {
        false
    }

    /// The result of a flight with this log.
    fn judge(&self, lines: Vec<Self::Line>) -> Self::Outcome;
}

/// Surroundings of a vehicle that follows a script.
pub struct Scripted<S> {
    script: S,
    clock: Clock,
}

impl<S: Script> Scripted<S> {
    /// Surroundings for one flight.
    #[must_use]
    pub fn new(script: &S) -> Self {
        Self { script: script.clone(), clock: Clock::new(Instant::ZERO) }
    }
}

impl<S: Script> Surroundings for Scripted<S> {
    type Runnables = S::Runnables;
    type Outcome = S::Outcome;
    type Around<'a>
        = Following<'a, S>
    where
        S: 'a;

    fn clock(&self) -> Clock {
        self.clock.clone()
    }

    fn start<'a>(&'a mut self, tasks: &mut Tasks<'a>, outside: Outside<'a, S::Runnables>) -> Following<'a, S> {
        self.script.start(&self.clock, tasks, outside);
        Following { script: &self.script, lines: Vec::new() }
    }
}

/// A running script.
pub struct Following<'a, S: Script> {
    script: &'a S,
    lines: Vec<S::Line>,
}

impl<S: Script> Around for Following<'_, S> {
    type Runnables = S::Runnables;
    type Outcome = S::Outcome;

    fn drive(&mut self, _: Instant) {}

    fn published(&mut self, topic: usize, _: Instant, words: &[u32]) {
        if topic == S::LOG {
            self.lines.extend(message::<S::Line>(words));
        }
    }

    fn progress(&self) -> (f32, &'static str) {
        (self.lines.len() as f32 / self.script.length().max(1) as f32, "driving")
    }

    fn is_over(&mut self, _: Instant) -> bool {
        self.lines.len() >= self.script.length() || self.script.is_ended()
    }

    fn finish(self) -> S::Outcome {
        self.script.judge(self.lines)
    }
}
