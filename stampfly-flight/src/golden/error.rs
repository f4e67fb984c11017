//! Why a record cannot be played.

use core::fmt;

/// Why a golden flight could not be played.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum GoldenError {
    /// These bytes are something else.
    NotGolden,
    /// Recorded with other topics or runnables.
    OtherTables,
    /// Bytes are missing, left over, or no entries.
    Damaged,
}

impl fmt::Display for GoldenError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotGolden => "not a golden flight",
            Self::OtherTables => "the golden flight was recorded with other topics or runnables",
            Self::Damaged => "the golden flight is damaged",
        })
    }
}

impl core::error::Error for GoldenError {}
