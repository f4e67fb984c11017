//! A flight in few bytes, losslessly: what came from outside and when passes ran, and now and then the state of the vehicle.
//!
//! Where a [`Recorder`](crate::Recorder) keeps every sample and every activation, this keeps what cannot be computed. What runs in
//! a pass follows from what the clock showed, from the topics and from what ran before, so a PC lets the [scheduler](stampfly_bus::Scheduler)
//! decide again. The core that flies copies words into a [`Ring`], and neither compresses nor compares; whoever has time takes them
//! out: a [`Streamer`] makes chunks for any carrier. On a PC, [`read`] runs the flight again and makes a log of it, which
//! is replayed, cut and exported like any other. Not for a look at the values: a log is.
//!
//! | part | for |
//! |---|---|
//! | [`Compact`], [`Watching`] | the core that flies: an observer of the flight loop |
//! | [`Ring`] | words from that core to another, or to another task |
//! | [`Streamer`], [`Chunks`], [`Chunk`], [`Receiver`] | chunks with a number and a check sum, for datagrams, files and connections |
//! | [`File`] | chunks behind each other, and the gaps between them (feature `replay`) |
//! | [`read`] | the flight again, as a log (feature `replay`) |
//!
//! # Words
//! All are little-endian. The first of an entry is its kind in the highest four bits, then `a` in eight and `b` in twenty.
//!
//! | kind | entry | a | b | words behind it |
//! |---|---|---|---|---|
//! | 1 | sample from outside | topic | line that saw it first, or 63 for all of the pass; generation in 14 bits | instant, low half; the message |
//! | 2 | pass: samples before it were there when it began | band | µs since the last pass | |
//! | 3 | the same, later | band | | clock, two words |
//! | 4 | a background activation has read its inputs, and runs later | band | | clock, two words |
//! | 5 | it has run | line | | |
//! | 6 | the next pass, or what has run, refused a line something | line | | bits, as in [`ActivationRecord::refused`](stampfly_types::ActivationRecord) |
//! | 7 | a sample that a runnable published, for comparison | topic | | generation; instant, two words; the message |
//! | 8 | a part begins, which can be read by itself | version | bytes of the vehicle's name | passes lost so far; the name |
//! | 9 | where a line is | line | inputs | what the scheduler keeps, 10 words; how far each input was read |
//! | 10 | [key frame](crate::key_frame) | | bytes | as many |

mod chunk;
#[cfg(feature = "replay")]
mod contents;
#[cfg(feature = "key-frame")]
mod entry;
#[cfg(feature = "replay")]
mod file;
#[cfg(feature = "key-frame")]
mod packed;
#[cfg(feature = "replay")]
mod read;
#[cfg(feature = "replay")]
mod rerun;
mod ring;
#[cfg(feature = "key-frame")]
mod watch;
#[cfg(feature = "replay")]
mod words;
#[cfg(feature = "key-frame")]
mod write;

pub use chunk::{Chunk, ChunkError, Chunks, MAGIC, OVERHEAD, Receiver, Streamer};
#[cfg(feature = "replay")]
pub use contents::{Contents, ReadError, Samples};
#[cfg(feature = "replay")]
pub use file::{File, FileError, vehicle_name};
#[cfg(feature = "replay")]
pub use read::read;
pub use ring::{Ring, RingReader, RingWriter};
#[cfg(feature = "key-frame")]
pub use write::{Compact, Kept, Watching};
