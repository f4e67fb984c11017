//! [`End`]: how much of a log could be read.

use core::fmt;

/// How much of a log could be read. The [`Reader`](super::Reader) determines it, and every program
/// that reads logs prints its `Display` text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum End {
    /// All bytes were read.
    #[default]
    Whole,
    /// The file ends inside a message, as after a crash or an incomplete download. Everything
    /// before was read.
    Cut {
        /// Byte offset of that message.
        at: usize,
        /// Bytes from there to the end of the file.
        rest: usize,
    },
    /// Some bytes are not a valid message. Everything else was read.
    Damaged {
        /// Byte offset of the first damage.
        at: usize,
        /// Number of damaged places.
        places: usize,
        /// Number of bytes skipped in all damaged places.
        skipped: usize,
    },
}

impl End {
    /// Whether all bytes were read.
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
