//! What can go wrong, by operation.

use crate::{AnyValue, Kind};
use core::fmt;
use sequential_storage::Error;

/// Why there is no store.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum OpenError<E> {
    /// The range is not at least three whole pages.
    NoRoom,
    /// The flash gives back something else than what was written.
    NotKept,
    /// The flash.
    Flash(E),
}

/// Why a value could not be loaded. The default applies.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum LoadError<E> {
    /// What is stored is outside its range, or not a number: the range has changed, or the flash lies.
    OutOfRange {
        /// What is stored.
        stored: AnyValue,
    },
    /// What is stored is of another type than asked for.
    OtherKind {
        /// Of which.
        stored: Kind,
    },
    /// Another name has the same number in flash, and is stored.
    NameTaken,
    /// The pages make no sense. [`ParameterStore::erase`](crate::ParameterStore::erase) helps.
    Corrupted,
    /// The flash.
    Flash(E),
}

/// Why a value was not saved. What was stored before still is, unless the flash does [not keep](Self::NotKept) things.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum SaveError<E> {
    /// The value is outside its range, or not a number.
    OutOfRange,
    /// The name is longer than [`LONGEST_NAME`](crate::LONGEST_NAME).
    NameTooLong,
    /// Another name has the same number in flash: one in four thousand million pairs has. Give it another name.
    NameTaken,
    /// More names than the pages have room for.
    Full,
    /// The flash took the value and gives back something else.
    NotKept,
    /// The pages make no sense. [`ParameterStore::erase`](crate::ParameterStore::erase) helps.
    Corrupted,
    /// The flash.
    Flash(E),
}

/// Why the pages were not erased, or not all of them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum EraseError<E> {
    /// The flash gives back something else than what was written.
    NotKept,
    /// The flash.
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
