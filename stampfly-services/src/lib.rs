#![doc = include_str!("../README.md")]
//!
//! # The parts
//! | module | what it is |
//! |---|---|
//! | [`access`] | the interface between a service and a vehicle |
//! | [`arbiter`] | which requester commands, for every vehicle |
//! | [`requests`] | parameters and console lines that a station requests |
//! | [`radio_requests`] | the same over the secure link, and the topics that a station watches |
//! | [`view`] | the newest sample of what every vehicle publishes, whatever its topic table |
//! | [`watches`] | the topics that a station wants to see, and when each is due |
//! | [`lease`] | one requester at a time commands: a page, a program, a station with the key, a transmitter |
//! | [`mission`] | steps that a vehicle flies one after the other |
//! | [`subscription`] | streams the flight record to one station at a time |
//! | [`telemetry`] | a packet for whoever listens, fifty times a second |
//! | [`data_stream`] | every control cycle, for whoever asked for it |
//! | [`tello`] | the text commands of a Tello, and its state |
//! | [`mavlink`] | the vehicle's end of MAVLink (feature `mavlink`) |
//! | [`cable`] | everything that is spoken on a serial line (feature `mavlink`) |
//! | [`association`] | when a board's radio joins an access point, and what it is told to |
//! | [`network`] | what is spoken at ports that others can reach (feature `mavlink`), and a stack of fixed size (feature `network`) |
//! | [`msp`] | the vehicle's end of MSP, for configurators |
//!
//! A service takes bytes and the time and gives bytes. It does no input or output, allocates nothing, and every client costs it a
//! bounded time; sockets in a simulation and a radio on a board are equally good at the other end.
#![no_std]

#[cfg(test)]
extern crate std;

pub mod access;
pub mod arbiter;
pub mod association;
#[cfg(feature = "mavlink")]
pub mod cable;
pub mod data_stream;
pub mod goal;
pub mod lease;
#[cfg(feature = "mavlink")]
pub mod mavlink;
pub mod mission;
pub mod msp;
#[cfg(feature = "mavlink")]
pub mod network;
pub mod radio_requests;
mod refusal;
pub mod requests;
mod stick_source;
pub mod subscription;
pub mod telemetry;
pub mod tello;
mod version;
pub mod view;
pub mod watches;

pub use access::{Request, VehicleAccess};
pub use arbiter::{ArbitratedAccess, Asked, CommandArbiter, CommandNotice, Pass, Passed, VehicleActions};
pub use data_stream::DataStream;
pub use lease::Lease;
pub use radio_requests::RadioRequests;
pub use refusal::{Connection, Refusal, Requester};
pub use requests::StationRequests;
pub use subscription::RecordSubscription;
pub use telemetry::Telemetry;
pub use tello::Tello;
pub use version::version;
pub use view::{Places, Samples, View};

/// The wire formats.
pub use stampfly_link as link;
/// Its trait for a vehicle's parameters is in signatures here.
pub use stampfly_param as param;
/// Messages, time, vectors: the words that signatures here are written in.
pub use stampfly_types as types;
