//! A simulated vehicle at its ports: sockets at this machine's side of `stampfly serve`.
//!
//! | part | what it does |
//! |---|---|
//! | [`PortOption`] | where a port is to be, as typed: `NAME=ADDRESS` or `NAME=off` |
//! | [`OpenPorts`] | opens a vehicle's ports and carries bytes between sockets and the flight |
//! | [`FlightLog`] | the log of what a vehicle does while it is armed, and shortly around it |
//! | [`RecordOut`], [`receive`] | the [compact record](stampfly_flight::compact) of a flight, in datagrams |
//!
//! What the bytes mean is the vehicle's business ([`Link`](stampfly_sim::vehicle::Link)).

mod age;
mod connections;
mod events;
mod flight_log;
mod greeting;
mod key;
mod option;
mod outbox;
mod ports;
mod record;
mod terminal;

pub use connections::Ended;
pub use flight_log::{Armed, ArmedWitness, FlightLog};
pub use greeting::Foreign;
pub use key::{Key, KeyError};
pub use option::{PortOption, PortOptionError};
pub use ports::{OpenError, OpenPorts, Page};
pub(crate) use record::write_chunk;
pub use record::{RecordOut, receive};
