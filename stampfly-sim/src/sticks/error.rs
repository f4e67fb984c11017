//! Errors of stick files.

use super::file::{LATEST, LONGEST_LINE, MODES, MOST_BYTES, MOST_ROWS};
use core::fmt;

/// Largest number of characters of a field repeated in an error.
const SHOWN: usize = 24;

/// Error in a stick file, with its line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StickError {
    /// Line, from 1; 0 for the file as a whole.
    pub line: usize,
    /// The error.
    pub kind: StickErrorKind,
}

/// Kind of an error in a stick file.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum StickErrorKind {
    /// The file cannot be read, with the system's message.
    Unreadable(String),
    /// No header.
    Empty,
    /// A header without rows.
    NoRows,
    /// More bytes than [`MOST_BYTES`].
    TooLarge,
    /// More rows than [`MOST_ROWS`].
    TooManyRows,
    /// A line with more bytes than [`LONGEST_LINE`].
    LineTooLong,
    /// A line is not UTF-8.
    NotText,
    /// The header lacks this column.
    MissingColumn(&'static str),
    /// The header has an unknown column.
    UnknownColumn(String),
    /// The header has a column twice.
    RepeatedColumn(&'static str),
    /// The row has another number of fields than the header.
    FieldCount {
        /// Fields of the row.
        found: usize,
        /// Fields of the header.
        wanted: usize,
    },
    /// The field is not a number in the range of its column.
    Number {
        /// The column.
        column: &'static str,
        /// Content of the field.
        text: String,
    },
    /// The field is neither 0 nor 1.
    Level {
        /// The column.
        column: &'static str,
        /// Content of the field.
        text: String,
    },
    /// The field is not a flight mode.
    Mode(String),
    /// The time is earlier than that of the previous row.
    GoesBack(String),
}

impl StickErrorKind {
    pub(super) const fn at(self, line: usize) -> StickError {
        StickError { line, kind: self }
    }
}

/// Shortens a text for display in an error.
pub(super) fn clipped(text: &str) -> String {
    let mut shown: String = text.chars().take(SHOWN).collect();
    if text.chars().nth(SHOWN).is_some() {
        shown.push('…');
    }
    shown
}

impl fmt::Display for StickError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.line > 0 {
            write!(f, "line {}: ", self.line)?;
        }
        self.kind.fmt(f)
    }
}

impl fmt::Display for StickErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unreadable(error) => f.write_str(error),
            Self::Empty => f.write_str("the file is empty: its first line names the columns"),
            Self::NoRows => f.write_str("there is no row below the header"),
            Self::TooLarge => write!(f, "the file is larger than {MOST_BYTES} bytes"),
            Self::TooManyRows => write!(f, "there are more than {MOST_ROWS} rows"),
            Self::LineTooLong => write!(f, "the line is longer than {LONGEST_LINE} bytes"),
            Self::NotText => f.write_str("the line is not UTF-8"),
            Self::MissingColumn(name) => write!(f, "column {name} is missing"),
            Self::UnknownColumn(name) => write!(f, "column '{name}' is unknown"),
            Self::RepeatedColumn(name) => write!(f, "column {name} is there twice"),
            Self::FieldCount { found, wanted } => write!(f, "{found} fields, and the header has {wanted}"),
            Self::Number { column: "t", text } => {
                write!(f, "t: '{text}' is no number of seconds from 0 to {LATEST}")
            }
            Self::Number { column, text } => write!(f, "{column}: '{text}' is no number from -1 to 1"),
            Self::Level { column, text } => write!(f, "{column}: '{text}' is neither 0 nor 1"),
            Self::Mode(text) => {
                let names = MODES.map(|(name, _)| name);
                write!(f, "mode: '{text}' is none of {}", names.join(", "))
            }
            Self::GoesBack(text) => write!(f, "t: {text} is before the time of the row above"),
        }
    }
}

impl core::error::Error for StickError {}
