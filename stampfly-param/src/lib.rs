#![doc = include_str!("../README.md")]
//!
//! # The parts
//! | item | what it is |
//! |---|---|
//! | [`parameters!`], [`ParameterTable`] | the table of a vehicle's parameters |
//! | [`Parameters`], [`ParameterInfo`], [`ParameterError`] | reading and changing by number, whatever holds the values |
//! | [`mod@parameters`] | the same by name, with the checks |
//! | [`ParameterField`], [`parameter_enums!`] | types of fields that can be parameters |
//! | [`rules!`], [`mod@rules`], [`Conflict`] | which two values cannot be combined, and why |
//! | [`ParameterSet`], [`ParameterRequest`], [`ParameterStatus`] | a change as a whole at the next period, and roll-back |
//! | [`RequestedParameters`] | the other end of the requests |
//! | [`ChangeDetector`] | which parameters of a configuration have changed |
//! | [`ParameterStore`], [`blocking::ParameterStore`] | values by name in NOR flash |
//! | [`Storable`], [`AnyValue`] | what can be stored |
//! | [`RamFlash`] | a flash in memory, for desktop programs and tests |
//! | [`Disarmed`] | the proof that every write requires |
//! | [`key`] | the number that stands for a name in flash |
//!
//! # Storage and power cuts
//! A value is appended and becomes valid with its last word, so after a cut each name has either
//! its previous value or the one that was being written. The tests cut every write and every
//! erasure at every word.
//!
//! [`ParameterStore::open`] erases pages that are not marked as a store, about 50 ms a page, once.
//! Load at power-on, save while disarmed. Not in flight: while flash is written, an ESP32 executes
//! only code in RAM, for up to 200 ms.
//!
//! A value is found by its name's 32-bit FNV-1a hash. Of two names with the same hash the second is
//! refused.
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
