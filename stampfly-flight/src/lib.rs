//! Everything a vehicle needs around its runnables: the loop that runs them, records them and repeats them.
//!
//! A vehicle is a topic table and an activation table (`stampfly-bus`). This crate is generic over both and knows no
//! vehicle: firmware, simulator, replay, golden flight, benches and tests use the same code and differ in clock and
//! caller.
//!
//! | module | what it is |
//! |---|---|
//! | [`flight_loop`] | runs what is due, in table order, and reports it to an observer |
//! | [`recorder`] | writes a flight as a log that can be flown again |
//! | [`key_frame`] | the whole state of a vehicle as bytes (feature `key-frame`) |
//! | [`replay`](mod@replay) | the flight again, compared bit for bit (feature `replay`) |
#![no_std]

#[cfg(any(test, feature = "replay"))]
extern crate alloc;

pub mod flight_loop;
#[cfg(feature = "key-frame")]
pub mod key_frame;
pub mod log_schema;
pub mod recorder;
#[cfg(feature = "replay")]
pub mod replay;

pub use flight_loop::{Assembled, FlightLoop, Observer, Pending};
pub use log_schema::LogSchema;
pub use recorder::Recorder;
#[cfg(feature = "replay")]
pub use replay::{Replay, ReplayError, ReplayOptions, replay};
