#![doc = include_str!("../README.md")]
//!
//! # The parts
//! | module | what it is | steps |
//! |---|---|---|
//! | [`path_manager`] | the cycle: from what is known and wanted to what the autopilot is to do | 50 Hz |
//! | [`modes`] | take-off, cruising, landing and taxiing with their stages, and which follows which | inside the path manager |
//! | [`orders`] | what is wanted, by whom, and where to | inside the path manager |
//! | [`watch`] | what is wrong: detects, never acts | 50 Hz |
//! | [`crash`], [`heights`] | whether it has crashed, and whether its height is one | inside the watch |
//! | [`config`] | an aircraft's speeds, heights and limits | |
//! | [`messages`] | what travels between them and the rest of a vehicle | |
//! | [`status()`] | the same state in the words that links, pages and missions read | |
#![no_std]

pub mod config;
pub mod crash;
pub mod heights;
pub mod messages;
pub mod modes;
pub mod orders;
pub mod path_manager;
mod status;
pub mod watch;

pub use config::Config;
pub use path_manager::{PathManager, Sensed};
/// Messages, time, vectors: the words that signatures here are written in.
pub use stampfly_types as types;
pub use status::status;
pub use watch::{Watch, Watched};
