//! Everything a vehicle needs around its runnables: the loop that runs them, records them and repeats them.
//!
//! A vehicle is a topic table and an activation table (`stampfly-bus`). This crate is generic over both and knows no
//! vehicle: firmware, simulator, replay, golden flight, benches and tests use the same code and differ in clock and
//! caller.
//!
//! | module | what it is |
//! |---|---|
//! | [`flight_loop`] | runs what is due, in table order, and reports it to an observer |
#![no_std]

#[cfg(any(test, feature = "alloc"))]
extern crate alloc;

pub mod flight_loop;

pub use flight_loop::{Assembled, FlightLoop, Observer, Pending};
