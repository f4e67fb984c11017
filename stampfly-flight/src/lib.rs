#![doc = include_str!("../README.md")]
//!
//! # The parts
//! Everything a vehicle needs around its runnables: the loop that runs them, records them and repeats them.
//!
//! A vehicle is a topic table and an activation table (`stampfly-bus`). This crate is generic over both and knows no
//! vehicle: firmware, simulator, replay, golden flight, benches and tests use the same code and differ in clock and
//! caller.
//!
//! | module | what it is |
//! |---|---|
//! | [`console`] | a command line over a serial port |
//! | [`doctor`] | a vehicle examines itself, one line a check |
//! | [`flight_loop`] | runs what is due, in table order, and reports it to an observer |
//! | [`recorder`] | writes a flight as a log that can be flown again |
//! | [`compact`] | everything a replay needs, in few bytes |
//! | [`live`] | parameters that change while the vehicle is on |
//! | [`key_frame`] | the whole state of a vehicle as bytes (feature `key-frame`) |
//! | [`replay`](mod@replay) | the flight again, compared bit for bit (feature `replay`) |
//! | [`black_box`] | the last seconds of a flight in memory, read out after landing |
//! | [`golden`] | a recorded flight that every machine must compute alike |
//! | [`hil`] | hardware in the loop: the vehicle flies a world at the other end of a line |
//! | [`mock`] | one runnable by itself, for tests |
//! | [`newest`] | the newest sample of every topic, shown without its type |
//! | [`profile`] | execution times against their budgets |
//! | [`task`] | the `async` task that flies |
//! | [`watchdog`] | cuts off motors that are not confirmed in time |
#![no_std]

#[cfg(any(test, feature = "replay"))]
extern crate alloc;
#[cfg(test)]
extern crate std;

pub mod black_box;
pub mod compact;
pub mod console;
mod crc;
pub mod doctor;
pub mod flight_loop;
pub mod golden;
pub mod hil;
#[cfg(feature = "key-frame")]
pub mod key_frame;
pub mod live;
pub mod log_schema;
pub mod messages;
pub mod mock;
pub mod newest;
pub mod profile;
pub mod recorder;
#[cfg(feature = "replay")]
pub mod replay;
pub mod task;
pub mod watchdog;

pub use black_box::BlackBox;
pub use flight_loop::{Assembled, FlightLoop, InPlace, Observer, Pending};
/// Its vectors and strings are in signatures here.
pub use heapless;
pub use log_schema::LogSchema;
pub use mock::Mock;
pub use newest::{NewestSamples, longest_message};
pub use profile::{Profile, Stopwatch};
pub use recorder::Recorder;
#[cfg(feature = "replay")]
pub use replay::{Replay, ReplayError, ReplayOptions, replay};
/// The tables, and the ends of their topics.
pub use stampfly_bus as bus;
/// Written to what is stored.
pub use stampfly_log as log;
/// Its traits for a vehicle's parameters are in signatures here.
pub use stampfly_param as param;
/// Messages, time, vectors: the words that signatures here are written in.
pub use stampfly_types as types;
pub use watchdog::Watchdog;

/// The vehicle that the tests run.
#[cfg(test)]
#[path = "../tests/flight/common/mod.rs"]
#[allow(dead_code, reason = "each test uses a part")]
mod rover;
