#![doc = include_str!("../README.md")]
//!
//! # The parts
//! | module | what it is |
//! |---|---|
//! | [`topics`], [`schedule`], [`runnables`] | the two tables, and what runs |
//! | [`path_manager`], [`modes`] | what it does: the cycle, and the modes with their stages |
//! | [`orders`] | what is wanted, by whom, and where to |
//! | [`navigation`] | where it is, and how the air moves |
//! | [`autopilot`] | gains, surfaces and throttle |
//! | [`watch`] | what is wrong |
//! | [`ground`] | what programs at the other end of the link may do |
//! | [`parameters`], [`messages`], [`family`] | numbers, what travels on the topics, and the same in the words of the family |
#![no_std]

#[cfg(feature = "simulation")]
#[macro_use]
extern crate std;

pub mod autopilot;
pub mod family;
pub mod ground;
pub mod messages;
pub mod modes;
pub mod navigation;
pub mod orders;
pub mod parameters;
pub mod path_manager;
pub mod runnables;
pub mod schedule;
#[cfg(feature = "simulation")]
pub mod simulation;
pub mod topics;
pub mod watch;

pub use parameters::Parameters;
pub use schedule::Runnables;
/// Messages, time, vectors: the words that signatures here are written in.
pub use stampfly_types as types;
