//! Who asks a vehicle for something, and why it does not get there.

use core::fmt;
use stampfly_param::ParameterError;

/// Number of a connection: a stream, an address of datagrams, a cable. Two that are there at the
/// same time have different ones.
pub type Connection = u32;

/// Who asks: not which kind of program, and not what number it gives itself, but which connection
/// it has. Another that calls itself the same is another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Requester {
    /// A page of the ground station, by its number.
    Page(u32),
    /// A program that speaks MAVLink. Routers put several on one connection; they have other
    /// systems or components.
    Mavlink {
        /// Its connection.
        connection: Connection,
        /// Its system.
        system: u8,
        /// Its component.
        component: u8,
    },
    /// A program that speaks the Tello's text commands.
    Tello(Connection),
    /// A person at the console.
    Console,
    /// A station on a secured link, by its connection: where its frames come from. Another station
    /// with the same key is another.
    Link(Connection),
    /// The transmitter that the vehicle is paired with, whose packets authenticate nobody.
    Transmitter,
}

impl Requester {
    /// Is it at this connection of MAVLink?
    #[must_use]
    pub const fn is_at(&self, at: Connection) -> bool {
        matches!(self, Self::Mavlink { connection, .. } if *connection == at)
    }
}

impl fmt::Display for Requester {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Page(number) => write!(f, "page {number}"),
            Self::Mavlink { connection, system, component } => {
                write!(f, "MAVLink {system}/{component}, line {connection}")
            }
            Self::Tello(connection) => write!(f, "a Tello program, line {connection}"),
            Self::Console => f.write_str("the console"),
            Self::Link(connection) => write!(f, "the station with the key, line {connection}"),
            Self::Transmitter => f.write_str("the transmitter"),
        }
    }
}

/// Why a command did not reach the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Refusal {
    /// Another program commands.
    Occupied(Requester),
    /// A pilot flies the vehicle.
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
            Self::Occupied(requester) => write!(f, "{requester} commands"),
            Self::PilotFlies => f.write_str("a pilot flies by hand"),
            Self::Full => f.write_str("the vehicle takes no more commands at the moment"),
            Self::Range => f.write_str("a number is out of range"),
            Self::Armed => f.write_str("only a disarmed vehicle does this"),
            Self::Unsupported => f.write_str("this vehicle does not do that"),
        }
    }
}

impl core::error::Error for Refusal {}

/// For requests that change parameters.
impl From<ParameterError> for Refusal {
    fn from(error: ParameterError) -> Self {
        match error {
            ParameterError::Busy => Self::Full,
            ParameterError::Unknown => Self::Unsupported,
            _ => Self::Range,
        }
    }
}
