//! Errors of the store, one type per operation.

use crate::{AnyValue, Kind};
use core::fmt;
use sequential_storage::Error;

/// Why there is no store.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum OpenError<E> {
    /// The range is not at least three whole pages.
    NoRoom,
    /// What was read back differs from what was written.
    NotKept,
    /// The flash reports an error.
    Flash(E),
}

/// Why a value could not be loaded. The default applies.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum LoadError<E> {
    /// The stored value is outside the range, or NaN: the range has changed, or the flash is
    /// defective.
    OutOfRange {
        /// The stored value.
        stored: AnyValue,
    },
    /// The stored value has another type.
    OtherKind {
        /// Its type.
        stored: Kind,
    },
    /// Another name has the same number in flash, and is stored.
    NameTaken,
    /// The pages are damaged. [`ParameterStore::erase`](crate::ParameterStore::erase) repairs them.
    Corrupted,
    /// The flash reports an error.
    Flash(E),
}

/// Why a value was not saved. The previous one is still stored, except after
/// [`NotKept`](Self::NotKept).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum SaveError<E> {
    /// The value is outside its range, or not a number.
    OutOfRange,
    /// The name is longer than [`LONGEST_NAME`](crate::LONGEST_NAME).
    NameTooLong,
    /// Another name has the same number in flash, as one in 2³² pairs of names has. Choose another
    /// name.
    NameTaken,
    /// More names than the pages have room for.
    Full,
    /// What was read back differs from what was written.
    NotKept,
    /// The pages are damaged. [`ParameterStore::erase`](crate::ParameterStore::erase) repairs them.
    Corrupted,
    /// The flash reports an error.
    Flash(E),
}

/// Why the pages were not erased, or not all of them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum EraseError<E> {
    /// What was read back differs from what was written.
    NotKept,
    /// The flash reports an error.
    Flash(E),
}

impl<E> From<EraseError<E>> for OpenError<E> {
    fn from(error: EraseError<E>) -> Self {
        match error {
            EraseError::NotKept => Self::NotKept,
            EraseError::Flash(error) => Self::Flash(error),
        }
    }
}

impl<E> From<Error<E>> for LoadError<E> {
    fn from(error: Error<E>) -> Self {
        match error {
            Error::Storage { value, .. } => Self::Flash(value),
            _ => Self::Corrupted,
        }
    }
}

impl<E> From<Error<E>> for SaveError<E> {
    fn from(error: Error<E>) -> Self {
        match error {
            Error::Storage { value, .. } => Self::Flash(value),
            Error::FullStorage | Error::ItemTooBig => Self::Full,
            _ => Self::Corrupted,
        }
    }
}

const TAKEN: &str = "another name has the same number in flash";
const NOT_KEPT: &str = "the flash does not keep what is written";

impl<E: fmt::Debug> fmt::Display for OpenError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoRoom => f.write_str("parameters need at least three whole pages of flash"),
            Self::NotKept => f.write_str(NOT_KEPT),
            Self::Flash(error) => write!(f, "flash: {error:?}"),
        }
    }
}

impl<E: fmt::Debug> fmt::Display for LoadError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfRange { stored } => write!(f, "the stored {stored} is out of range"),
            Self::OtherKind { stored } => write!(f, "the stored value is a {stored:?}"),
            Self::NameTaken => f.write_str(TAKEN),
            Self::Corrupted => f.write_str("the stored parameters are damaged"),
            Self::Flash(error) => write!(f, "flash: {error:?}"),
        }
    }
}

impl<E: fmt::Debug> fmt::Display for SaveError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfRange => f.write_str("the value is out of range"),
            Self::NameTooLong => f.write_str("the name is too long"),
            Self::NameTaken => f.write_str(TAKEN),
            Self::Full => f.write_str("no room for another parameter"),
            Self::NotKept => f.write_str(NOT_KEPT),
            Self::Corrupted => f.write_str("the stored parameters are damaged"),
            Self::Flash(error) => write!(f, "flash: {error:?}"),
        }
    }
}

impl<E: fmt::Debug> fmt::Display for EraseError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotKept => f.write_str(NOT_KEPT),
            Self::Flash(error) => write!(f, "flash: {error:?}"),
        }
    }
}

impl<E: fmt::Debug> core::error::Error for OpenError<E> {}
impl<E: fmt::Debug> core::error::Error for LoadError<E> {}
impl<E: fmt::Debug> core::error::Error for SaveError<E> {}
impl<E: fmt::Debug> core::error::Error for EraseError<E> {}
