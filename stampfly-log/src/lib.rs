#![doc = include_str!("../README.md")]
//!
//! # Modules
//! The flight record in a file format that public tools open and a replay reproduces exactly.
//!
//! | module | contents | use it |
//! |---|---|---|
//! | [`ulog`] | writer and reader of ULog, the file format of PX4 | for every flight log, on the vehicle and on a host |
//! | [`csv`] | lossless CSV for one type of message | for small logs for tools and people |
//! | [`trace`] | the inputs that each activation of a runnable has read | when a log must replay bit for bit |
//! | [`hash`] | one 64-bit number for a whole flight | to check whether two flights were identical |
//! | [`plain()`] | text with escaped control characters | to print names from a log on a terminal |
//!
//! Nothing here does input or output, allocates or reads a clock: the writer passes finished
//! messages to a [`ulog::Sink`], and the reader iterates over a byte slice. Samples are written
//! from the 32-bit words of [`stampfly_types::Message`] and read back as the same words, NaN
//! payloads included.
//!
//! Time series by column, plots and other functions that need an allocator are in the host program.
//!
//! # Example
//! ```
//! use stampfly_log::ulog::{Definitions, Message, Ram, Reader, Sample, Topic};
//! use stampfly_types::{Instant, Message as _, messages::PowerData};
//!
//! const TOPICS: &[Topic] = &[Topic { name: "sensor_power", fields: PowerData::FIELDS }];
//! let mut memory = [0; 4096];
//! let mut log = Definitions::start(Ram::new(&mut memory), Instant::ZERO)?.data(TOPICS)?;
//! let words = PowerData { voltage: 3.9, current: 2.0, power: 7.8 }.to_words();
//! log.sample(0, &Sample { at: Instant::from_micros(2_500), generation: 1, words: &words })?;
//!
//! let bytes = log.sink().written();
//! let mut read = PowerData::ZERO;
//! for message in Reader::new(bytes).expect("a ULog") {
//!     if let Message::Data { payload, .. } = message.expect("intact") {
//!         assert_eq!(TOPICS[0].decode(payload, &mut read).expect("ours").at, Instant::from_micros(2_500));
//!     }
//! }
//! assert_eq!(read, words);
//! # Ok::<(), stampfly_log::ulog::WriteError<stampfly_log::ulog::Full>>(())
//! ```
#![no_std]

#[cfg(test)]
extern crate std;

pub mod csv;
pub mod hash;
mod plain;
pub mod trace;
pub mod ulog;

pub use hash::FlightHash;
pub use plain::{Plain, plain};
/// Messages, time and vectors, which appear in signatures of this crate.
pub use stampfly_types as types;
pub use trace::ActivationTopic;
