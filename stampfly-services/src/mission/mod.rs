//! A list of steps that a vehicle flies by itself: take off, go there, stay, land.
//!
//! | file | what it does |
//! |---|---|
//! | `step.rs` | what a mission is made of, and what happens in it |
//! | `runner.rs` | which step it is, and the commands that it takes |
//!
//! A mission is flown with the same guided commands that any program has, one step at a time, through a [`VehicleAccess`](crate::VehicleAccess): what flies is
//! told apart by nothing here. Who uploads it, and in which format, is another module's business ([`mavlink`](crate::mavlink) has one). Not for a
//! path that has to be followed to the centimetre: a step ends when the vehicle is near its place.

mod runner;
mod step;

pub use runner::Runner;
pub use step::{Event, Halt, Step, Steps};
