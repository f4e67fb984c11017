//! What was in a compact record that was read, and why one cannot be.

use super::file::FileError;
use crate::key_frame::KeyFrameError;
use core::fmt;
use stampfly_types::{Duration, Instant};

/// Which samples of runnables go into the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Samples {
    /// Those that were kept in flight: what a [replay](crate::replay::replay) compares. It is told that the log
    /// [is thinned](crate::ReplayOptions::is_thinned).
    Recorded,
    /// Everything that was published when the flight was run again: for people and their tools.
    Again,
}

/// What was in a record.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Contents {
    /// Activations that were run again.
    pub activations: u64,
    /// Samples from outside.
    pub samples: u64,
    /// Samples of runnables that were kept for comparison.
    pub kept: u64,
    /// Key frames.
    pub key_frames: u64,
    /// How often something is missing: the carrier lost it, or there was no room for it in flight.
    pub gaps: u64,
    /// Passes that there was no room for in flight, up to the last key frame.
    pub lost: u32,
    /// The first key frame was made then, the last pass ran then.
    pub span: Option<[Instant; 2]>,
    /// In a pass since then, nothing is due when the flight is run again: it is another program's record, or a changed one.
    pub idle_since: Option<Instant>,
}

impl Contents {
    /// From the first key frame to the last pass.
    #[must_use]
    pub fn duration(&self) -> Duration {
        self.span.map_or(Duration::ZERO, |[from, to]| to.since(from))
    }
}

/// Why a compact record cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ReadError {
    /// It is something else.
    File(FileError),
    /// No part of it can be read by itself.
    NoKeyFrame,
    /// A key frame cannot be used.
    KeyFrame(KeyFrameError),
    /// It makes no sense at this word of a part: another version's, perhaps.
    Damaged(usize),
    /// The log took no more.
    Full,
}

impl fmt::Display for ReadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(error) => write!(f, "{error}"),
            Self::NoKeyFrame => f.write_str("the record holds no key frame to begin with"),
            Self::KeyFrame(error) => write!(f, "{error}"),
            Self::Damaged(word) => write!(f, "the record makes no sense at word {word} of a part"),
            Self::Full => f.write_str("the log took no more"),
        }
    }
}

impl core::error::Error for ReadError {}
