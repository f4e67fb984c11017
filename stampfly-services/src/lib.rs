#![doc = include_str!("../README.md")]
//!
//! # The parts
//! | module | what it is |
//! |---|---|
//! | [`cockpit`] | what a service sees of a vehicle, and what it may ask for |
//! | [`view`] | the newest sample of what every vehicle publishes, whatever its topic table |
//! | [`lease`] | one program at a time commands; whoever flies by hand comes first |
//! | [`mission`] | steps that a vehicle flies one after the other |
//! | [`telemetry`] | a packet for whoever listens, fifty times a second |
//! | [`data_stream`] | every control cycle, for whoever asked for it |
//! | [`tello`] | the text commands of a Tello, and its state |
//! | [`mavlink`] | the vehicle's end of MAVLink (feature `mavlink`) |
//! | [`msp`] | the vehicle's end of MSP, for configurators |
//!
//! A service takes bytes and the time and gives bytes. It does no input or output, allocates nothing, and every client costs it a
//! bounded time; sockets in a simulation and a radio on a board are equally good at the other end.
#![no_std]

#[cfg(test)]
extern crate std;

pub mod cockpit;
pub mod data_stream;
pub mod lease;
#[cfg(feature = "mavlink")]
pub mod mavlink;
pub mod mission;
pub mod msp;
mod refusal;
pub mod telemetry;
pub mod tello;
pub mod view;

pub use cockpit::{Cockpit, Request};
pub use data_stream::DataStream;
pub use lease::Lease;
pub use refusal::{Refusal, Seat};
pub use telemetry::Telemetry;
pub use tello::Tello;
pub use view::{Places, Samples, View};

/// The wire formats.
pub use stampfly_link as link;
/// Messages, time, vectors: the words that signatures here are written in.
pub use stampfly_types as types;
