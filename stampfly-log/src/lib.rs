#![doc = include_str!("../README.md")]
//!
//! # The parts
//! The flight record: what happened, in a file that public tools open and that a replay can trust.
//!
//! | module | what it is | when to use it |
//! |---|---|---|
//! | [`ulog`] | writer and reader of ULog, the file format of PX4 | every flight log, on the vehicle and on a host |
//! | [`csv`] | one type of message as CSV that reads back bit for bit | small logs for tools and people |
//! | [`trace`] | what each activation of a runnable saw | when a log must replay bit for bit |
//! | [`hash`] | one 64-bit number for a whole flight | to ask whether two flights were the same |
//! | [`plain()`] | text from a file without what a terminal obeys | to print a name that a log's writer chose |
//!
//! Nothing here does input or output, allocates or reads a clock: the writer hands finished messages to a
//! [`ulog::Sink`], the reader walks over a byte slice. Samples are written from the 32-bit words of
//! [`stampfly_types::Message`] without loss, NaN payloads included, and read back as the same words.
//!
//! Not here: column-wise series, plots and other things that need an allocator; those live in the host program.
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
/// Messages, time, vectors: the words that signatures here are written in.
pub use stampfly_types as types;
pub use trace::ActivationTopic;
