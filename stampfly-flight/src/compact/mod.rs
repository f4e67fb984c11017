//! A flight in few bytes, losslessly: everything from outside, every activation and key frames, for a replay bit for bit.
//!
//! Where a [`Recorder`](crate::Recorder) keeps every sample of every topic, this keeps what cannot be computed: samples from
//! outside, how far each activation had read, now and then the state of the vehicle, and some samples of runnables by which a
//! replay is judged. It needs no taps and no second task: it is an observer of the flight loop and looks at the topics between
//! two passes. [`Ring`] holds the last seconds; whatever else takes bytes implements [`Store`]. On a PC, [`read`] makes
//! a log of it, which is replayed, cut and exported like any other. Not for a look at the values: a log is.
//!
//! | entry | bytes |
//! |---|---|
//! | sample | topic; instant and generation against those expected; two words' widths in a byte, then each word's difference |
//! | activation | line, and whether instant and inputs are as expected; if not, a bit for each input, and what it is |
//! | refused | line; what its last activation was refused |
//! | end of a pass | 1. The samples before it were there when its activations, before them, read |
//! | loss | 1. Something is missing before the next key frame |
//! | key frame | length, and as many bytes; everything expected is forgotten |
//!
//! Numbers are variable-length, seven bits a byte, the lowest first. Differences are between bit patterns: nothing is rounded.

mod model;
#[cfg(feature = "replay")]
mod read;
mod ring;
#[cfg(test)]
mod tests;
mod write;

#[cfg(feature = "replay")]
pub use read::{ReadError, read, shares};
pub use ring::{Ring, Store};
pub use write::{Compact, Watching};
