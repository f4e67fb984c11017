#![doc = include_str!("../README.md")]
//!
//! # The parts
//! | module | what it is |
//! |---|---|
//! | [`topics`], [`schedule`], [`runnables`] | the two tables, and what runs |
//! | [`stampfly_fixed_wing`] | what it does: path manager, modes with their stages, what is wrong and what follows |
//! | [`behaviour`] | its speeds, heights and limits there |
//! | [`navigation`] | where it is, and how the air moves |
//! | [`autopilot`] | gains, surfaces and throttle |
//! | [`protection`] | what this airframe bears, and what its inertial sensor must show |
//! | [`ground`] | what programs at the other end of the link may do |
//! | [`parameters`] | its numbers |
#![no_std]

#[cfg(feature = "simulation")]
#[macro_use]
extern crate std;

pub mod autopilot;
pub mod behaviour;
pub mod ground;
pub mod navigation;
pub mod parameters;
pub mod protection;
pub mod runnables;
pub mod schedule;
#[cfg(feature = "simulation")]
pub mod simulation;
pub mod topics;

pub use parameters::Parameters;
pub use schedule::Runnables;
/// What travels on the topics, beside the family's own messages.
pub use stampfly_fixed_wing::messages;
/// Messages, time, vectors: the words that signatures here are written in.
pub use stampfly_types as types;
