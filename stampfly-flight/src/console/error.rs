//! Why a line is no command, as the person who typed it is told.

use core::fmt;

/// Most words of a line.
pub const MAX_WORDS: usize = 8;

/// Why a line is no command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CommandError {
    /// There is no such command.
    Unknown,
    /// The command exists and is written like this.
    Usage(&'static str),
    /// More than [`MAX_WORDS`] words.
    TooManyWords,
}

impl fmt::Display for CommandError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown => f.write_str("there is no such command; try help"),
            Self::Usage(usage) => write!(f, "usage: {usage}"),
            Self::TooManyWords => write!(f, "at most {MAX_WORDS} words"),
        }
    }
}

impl core::error::Error for CommandError {}
