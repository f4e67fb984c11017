//! What a service sees of a vehicle, and what it may ask for.
//!
//! A vehicle implements [`Cockpit`] on a struct that borrows what is needed: where the newest samples are kept, the
//! publishers of its commands, its parameters. Whether a command is obeyed is the mode machine's decision, and seen in the
//! [`view`](Cockpit::view); a [`Refusal`] says that it did not even get there.

use crate::view::View;
use core::fmt;
use stampfly_flight::parameters::Parameters;
use stampfly_types::Instant;
use stampfly_types::messages::{GuidedCommand, GuidedKind, PilotInput};

/// Who asks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Seat {
    /// The page of the ground station.
    Page,
    /// A program that speaks MAVLink, by its system.
    Mavlink(u8),
    /// A program that speaks the Tello's text commands.
    Tello,
    /// A person at the console.
    Console,
    /// A program on a secured link.
    Link,
}

impl fmt::Display for Seat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Page => f.write_str("the ground station's page"),
            Self::Mavlink(system) => write!(f, "MAVLink system {system}"),
            Self::Tello => f.write_str("a Tello program"),
            Self::Console => f.write_str("the console"),
            Self::Link => f.write_str("a program on the radio"),
        }
    }
}

/// What a board does for a disarmed vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Request {
    /// Keep the parameters over a restart.
    SaveParameters,
    /// Turn one motor for a moment.
    TestMotor {
        /// From 1.
        motor: u8,
        /// Share of the full duty.
        duty: f32,
    },
    /// Stop a motor test.
    StopMotor,
}

/// Why a command did not reach the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Refusal {
    /// Another program commands.
    Occupied(Seat),
    /// A pilot flies by hand.
    PilotFlies,
    /// The vehicle takes no more commands at the moment.
    Full,
    /// A number in it is none, or no vehicle can do it.
    Range,
    /// Only a disarmed vehicle does this.
    Armed,
    /// This vehicle does not do that.
    Unsupported,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Occupied(seat) => write!(f, "{seat} commands"),
            Self::PilotFlies => f.write_str("a pilot flies by hand"),
            Self::Full => f.write_str("the vehicle takes no more commands at the moment"),
            Self::Range => f.write_str("a number is out of range"),
            Self::Armed => f.write_str("only a disarmed vehicle does this"),
            Self::Unsupported => f.write_str("this vehicle does not do that"),
        }
    }
}

impl core::error::Error for Refusal {}

/// A vehicle, as services see it.
pub trait Cockpit {
    /// What it has published.
    fn view(&self) -> View<'_>;

    /// Asks for something.
    ///
    /// # Errors
    /// When it does not get to the mode machine.
    fn guide(&mut self, now: Instant, seat: Seat, command: GuidedCommand) -> Result<(), Refusal>;

    /// Forgets the route, and goes to a place.
    ///
    /// # Errors
    /// When it does not get to the mode machine.
    fn fly_to(&mut self, now: Instant, seat: Seat, way_point: GuidedCommand) -> Result<(), Refusal> {
        self.guide(now, seat, GuidedCommand { kind: GuidedKind::Hold, ..Default::default() })?;
        self.guide(now, seat, GuidedCommand { kind: GuidedKind::WayPoint, ..way_point })
    }

    /// Hands over a frame of sticks and switches, as a transmitter would.
    ///
    /// # Errors
    /// When another transmitter is heard.
    fn steer(&mut self, now: Instant, seat: Seat, input: &PilotInput) -> Result<(), Refusal>;

    /// A sign of life of whoever sits there: what keeps the vehicle from taking its link for lost.
    fn alive(&mut self, now: Instant, seat: Seat);

    /// Its parameters.
    fn parameters(&mut self) -> &mut dyn Parameters;

    /// Asks the board for something. A vehicle does none of it unless it says so.
    ///
    /// # Errors
    /// When it is armed, or does not do that.
    fn request(&mut self, _now: Instant, _request: Request) -> Result<(), Refusal> {
        Err(Refusal::Unsupported)
    }
}
