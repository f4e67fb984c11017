//! Why a file is no recording, and where in the file.

use std::fmt;
use std::path::PathBuf;

/// Why a file is no recording.
#[derive(Debug)]
pub struct DatasetError {
    /// The file.
    pub file: PathBuf,
    /// What is wrong with it.
    pub kind: DatasetErrorKind,
}

/// What is wrong with a file.
#[derive(Debug)]
#[non_exhaustive]
pub enum DatasetErrorKind {
    /// It could not be read.
    Io(std::io::Error),
    /// None of the known formats begins like this.
    Unknown {
        /// The first characters.
        begins: String,
    },
    /// A line of a CSV file is broken.
    Line {
        /// Line number, from one.
        line: usize,
        /// The column.
        field: String,
        /// What is wrong.
        problem: String,
    },
    /// An array of an NPZ file is missing or broken.
    Array {
        /// The array, or column of an array.
        field: String,
        /// What is wrong.
        problem: String,
    },
    /// It is HDF5, of which MATLAB's version 7.3 is a kind.
    Hdf5,
    /// There is not one usable inertial sample.
    Empty,
}

impl fmt::Display for DatasetErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io(error) => error.fmt(f),
            Self::Unknown { begins } => write!(f, "no known kind of recording begins with `{begins}`"),
            Self::Line { line, field, problem } => write!(f, "line {line}: {field}: {problem}"),
            Self::Array { field, problem } => write!(f, "array {field}: {problem}"),
            Self::Hdf5 => f.write_str("HDF5 is not read; BROAD has the same trials in data_mat, which are"),
            Self::Empty => f.write_str("no usable inertial sample"),
        }
    }
}

impl fmt::Display for DatasetError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.file.display(), self.kind)
    }
}

impl std::error::Error for DatasetError {}

impl std::error::Error for DatasetErrorKind {}
