#![doc = include_str!("../README.md")]
//!
//! # The parts
//! | module | what it is |
//! |---|---|
//! | [`topics`], [`schedule`], [`runnables`] | the two tables, and what runs |
//! | [`attitude`], [`rate_loops`], [`battery`], [`lamps`], [`startup`] | components, without a clock or a bus |
//! | [`protection`], [`airframe`] | what stops the motors beside the pilot, and the frame that it is for |
//! | [`receiver`], [`serial`] | a transmitter's packets, through the radio; MSP on the serial line |
//! | [`frame`] | which motors an axis moves |
//! | [`eeprom`] | what is kept while it is off |
//! | [`parameters`], [`messages`], [`family`] | numbers, what travels on the topics, and the same in the words of the family |
//!
//! # Frame
//! Body FRD and world NED, as everywhere in the family and in the original.
#![no_std]

#[cfg(feature = "simulation")]
#[macro_use]
extern crate std;

pub mod airframe;
pub mod attitude;
pub mod battery;
pub mod eeprom;
pub mod family;
pub mod frame;
pub mod lamps;
pub mod messages;
pub mod parameters;
pub mod protection;
pub mod rate_loops;
pub mod receiver;
pub mod runnables;
pub mod schedule;
pub mod serial;
#[cfg(feature = "simulation")]
pub mod simulation;
pub mod startup;
pub mod topics;

pub use parameters::Parameters;
pub use schedule::Runnables;
/// Messages, time, vectors: the words that signatures here are written in.
pub use stampfly_types as types;
