//! What can go wrong with a chip on a bus.

use crate::{SensorError, SensorErrorKind};
use core::fmt::Debug;

/// An error of a chip driver; `E` is the bus's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ChipError<E> {
    /// The bus refused or garbled the transfer.
    Bus(E),
    /// The transfer took longer than its length allows ([`TransferLimit`](super::TransferLimit)) and was given up.
    BusTimeout,
    /// The chip answers but made no new sample in time.
    NoSample,
    /// Another chip, or none, answered; this is what it called itself.
    Identification {
        /// The identification that was read.
        found: u16,
    },
    /// A pin of the chip could not be set.
    Pin,
    /// Another chip answers at the address this one starts up with, so it is kept in reset.
    AddressTaken,
    /// The configuration handed to the driver cannot be, so nothing was sent.
    InvalidConfiguration,
    /// The chip did not start or did not keep what was written; this is its status register, or what it kept.
    Configuration {
        /// The chip's answer.
        status: u8,
    },
    /// The chip lost its configuration since the last call. The next call sets it up again.
    Restarted,
    /// The self test failed.
    SelfTest,
    /// The chip answered with data that cannot be.
    Data,
}

impl<E: Debug> SensorError for ChipError<E> {
    fn kind(&self) -> SensorErrorKind {
        match self {
            Self::Bus(_) => SensorErrorKind::Bus,
            Self::BusTimeout | Self::NoSample => SensorErrorKind::Timeout,
            Self::Identification { .. } => SensorErrorKind::Identification,
            Self::InvalidConfiguration | Self::Configuration { .. } | Self::AddressTaken => {
                SensorErrorKind::Configuration
            }
            Self::Restarted | Self::Pin => SensorErrorKind::Other,
            Self::SelfTest => SensorErrorKind::SelfTest,
            Self::Data => SensorErrorKind::Data,
        }
    }
}
