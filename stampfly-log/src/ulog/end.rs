//! How far a log is whole.

use core::fmt;

/// How far a log is whole. The [`Reader`](super::Reader) decides it; every program that reads logs
/// says it with the sentence that this displays as.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum End {
    /// Every byte of it was read.
    #[default]
    Whole,
    /// The file ends within a message, as after a crash or a broken download. Everything before was
    /// read.
    Cut {
        /// Byte offset of that message.
        at: usize,
        /// Bytes from there to the end of the file.
        rest: usize,
    },
    /// Some of it is no message. Everything else was read.
    Damaged {
        /// Byte offset of the first damage.
        at: usize,
        /// Number of damaged places.
        places: usize,
        /// Bytes that were passed over, in all places together.
        skipped: usize,
    },
}

impl End {
    /// Was every byte read?
    #[must_use]
    pub const fn is_whole(self) -> bool {
        matches!(self, Self::Whole)
    }
}

impl fmt::Display for End {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Whole => f.write_str("whole"),
            Self::Cut { at, rest } => write!(f, "cut off at byte {at}: the last {rest} bytes are no whole message"),
            Self::Damaged { at, places: 1, skipped } => {
                write!(f, "damaged at byte {at}: {skipped} bytes were passed over")
            }
            Self::Damaged { at, places, skipped } => {
                let more = places.saturating_sub(1);
                write!(f, "damaged at byte {at} and in {more} places more: {skipped} bytes were passed over")
            }
        }
    }
}
