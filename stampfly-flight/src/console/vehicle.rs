//! What the console asks of a vehicle.

use super::error::CommandError;
use crate::doctor::Fact;
use crate::profile::Rows;
use core::fmt;
use stampfly_bus::TopicInfo;
use stampfly_param::Parameters;
use stampfly_types::Instant;

/// How a sensor's driver does.
#[derive(Clone, Copy)]
pub struct SensorLine<'c> {
    /// Name of its topic without `sensor_`.
    pub name: &'c str,
    /// Samples published since power-on.
    pub samples: u32,
    /// Errors since power-on.
    pub errors: u32,
    /// The newest error, whether or not the driver has recovered.
    pub last_error: Option<&'c dyn fmt::Display>,
}

/// A vehicle at a console: what it knows, and its own commands.
///
/// Implement it on a struct that borrows what is needed for one answer. See [`answer`](super::answer) for an example.
pub trait Vehicle {
    /// The vehicle's own commands; [`Infallible`](core::convert::Infallible) when it has none.
    type Command;
    /// What only the board can do for them; `Infallible` when there is nothing.
    type Request;
    /// The vehicle's own commands for `help`: how they are written, and what they do.
    const COMMANDS: &'static [(&'static str, &'static str)];
    /// The topic table.
    const TOPICS: &'static [TopicInfo];

    /// Is it armed? `None` while that is unknown, which counts as armed.
    fn is_armed(&self) -> Option<bool>;

    /// Version of the firmware.
    fn version(&self) -> &str;

    /// Writes its state, in lines that end with a carriage return and a line feed.
    ///
    /// # Errors
    /// When `reply` does not take it.
    fn status(&self, now: Instant, reply: &mut dyn fmt::Write) -> fmt::Result;

    /// The newest sample of the topic at this place in the table, as
    /// [`NewestSamples::words`](crate::NewestSamples::words) returns it.
    fn newest(&self, topic: usize) -> Option<(Instant, &[u32])>;

    /// Every sensor.
    fn sensors(&self) -> &[SensorLine<'_>];

    /// Execution times, as [`Profile::rows`](crate::Profile::rows) returns them.
    fn profile(&self) -> Rows<'_>;

    /// What only the board knows, for `doctor`. Nothing by default.
    fn facts(&self) -> &[Fact<'_>] {
        &[]
    }

    /// The configuration of the next start.
    fn parameters(&mut self) -> &mut dyn Parameters;

    /// Reads a command of its own. There is at least one word, and it is none of the console's.
    ///
    /// # Errors
    /// When there is no such command, or it is written differently.
    fn parse(words: &[&str]) -> Result<Self::Command, CommandError>;

    /// Answers a command of its own, and returns what only the board can do.
    ///
    /// # Errors
    /// When `reply` does not take the answer.
    fn answer(
        &mut self,
        command: Self::Command,
        now: Instant,
        reply: &mut dyn fmt::Write,
    ) -> Result<Option<Self::Request>, fmt::Error>;

    /// Must the vehicle be disarmed for this? The answer is yes, except for what makes it safer, such as stopping a test.
    fn needs_disarmed(_request: &Self::Request) -> bool {
        true
    }

    /// Does this ask for nothing but saving the parameters, which the answer has changed?
    fn is_save(_request: &Self::Request) -> bool {
        false
    }
}
