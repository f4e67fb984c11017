#![doc = include_str!("../README.md")]
//!
//! # The parts
//! Parameters: a table of them, a change while the vehicle runs, and values that survive a power cut.
//!
//! | type | what it is |
//! |---|---|
//! | [`parameters!`] | declares a vehicle's parameters: name, default, range, unit |
//! | [`ParameterSet`] | applies a change as a whole at the next period, and rolls it back |
//! | [`ParameterStore`] | loads and saves values by name, on any NOR flash |
//! | [`Disarmed`] | the proof without which nothing is written |
//! | [`key`] | the number a name has in flash |
//!
//! Use it at power-on, to overlay a vehicle's defaults with what its owner has saved, and from a console. Not in flight:
//! while flash is written, an ESP32 runs nothing that is not in RAM, for up to 200 ms.
//!
//! A name is stored as its 32-bit FNV-1a hash. A table of parameters should be tested for two names with one hash.
//!
//! # What a power cut can do
//! A value is appended and becomes valid with its last word, so after a cut each name has the value before it or the one
//! that was being written. The tests cut every write and every erasure at every word.
//!
//! # What was in flash before
//! It may be anything: the first page of a store says that the store has erased the others. Where it does not say so
//! [`ParameterStore::open`] erases all of them, which takes some 50 ms a page and happens once.
#![no_std]

#[cfg(test)]
extern crate std;

mod disarmed;
mod error;
mod pages;
mod set;
mod store;
mod table;

pub use disarmed::Disarmed;
pub use error::{EraseError, LoadError, OpenError, SaveError};
pub use set::{ParameterAction, ParameterRequest, ParameterSet, ParameterStatus};
pub use store::{ParameterStore, key};
pub use table::{Parameter, ParameterError, ParameterTable};

/// Its traits are in signatures here.
pub use embedded_storage_async;
/// Messages, time, vectors: the words that signatures here are written in.
pub use stampfly_types as types;
