#![doc = include_str!("../README.md")]
//!
//! # The parts
//! Parameters: a table of them, a change while the vehicle runs, and values that survive a power cut.
//!
//! | type | what it is |
//! |---|---|
//! | [`parameters!`] | declares a vehicle's parameters: name, default, range, unit |
//! | [`rules!`], [`rules::check`] | which two values cannot be together, and why |
//! | [`ParameterSet`] | applies a change as a whole at the next period, and rolls it back |
//! | [`ParameterStore`] | loads and saves values by name, on any NOR flash; [`blocking::ParameterStore`] without `async` |
//! | [`Storable`], [`AnyValue`] | what can be saved: numbers, yes or no, up to 32 bytes |
//! | [`RamFlash`] | a flash that forgets, for desktop programs and tests |
//! | [`Disarmed`] | the proof without which nothing is written |
//! | [`key`] | the number a name has in flash |
//!
//! Use it at power-on, to overlay a vehicle's defaults with what its owner has saved, and from a console. Not in flight:
//! while flash is written, an ESP32 runs nothing that is not in RAM, for up to 200 ms.
//!
//! A value is stored with its type and its name, and found by the name's 32-bit FNV-1a hash. Two names with one hash are told
//! apart: the second is refused.
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

pub mod blocking;
mod detector;
mod disarmed;
mod error;
mod field;
mod pages;
pub mod parameters;
mod ram;
mod requested;
pub mod rules;
mod set;
mod store;
mod table;
mod value;

pub use detector::ChangeDetector;
pub use disarmed::Disarmed;
pub use error::{EraseError, LoadError, OpenError, SaveError};
pub use field::ParameterField;
pub use parameters::{Number, ParameterError, ParameterInfo, Parameters};
pub use ram::RamFlash;
pub use requested::RequestedParameters;
pub use rules::Conflict;
pub use set::{ParameterAction, ParameterRequest, ParameterSet, ParameterStatus};
pub use store::{ParameterStore, key};
pub use table::{Parameter, ParameterTable};
pub use value::{AnyValue, Kind, LONGEST_NAME, Storable};

/// Its traits are in signatures here.
pub use embedded_storage_async;
/// Messages, time, vectors: the words that signatures here are written in.
pub use stampfly_types as types;
