//! Who asks a vehicle for something, and why it does not get there.

use core::fmt;

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
