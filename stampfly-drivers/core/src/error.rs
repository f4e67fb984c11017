//! What can go wrong with a sensor, in terms a program can act on.
//!
//! Every driver has an error type of its own that says more; [`SensorError::kind`] is the part that is the same
//! for all of them, as in `embedded-hal`.

use core::convert::Infallible;
use core::error::Error;
use core::fmt::{self, Debug, Display};

/// The kind of a sensor error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SensorErrorKind {
    /// The bus refused or garbled the transfer.
    Bus,
    /// No new sample within the time the sensor promises.
    Timeout,
    /// Another chip answered.
    Identification,
    /// The chip did not accept its configuration.
    Configuration,
    /// The chip's self test failed.
    SelfTest,
    /// The chip answered with data that cannot be.
    Data,
    /// The chip lost its settings; the next call sets it up again.
    Restarted,
    /// No chip answered: the data line was as one that nobody drives, all ones or all zeros.
    Absent,
    /// What the chip measured could not be right; it measures another way from the next call on.
    Implausible,
    /// None of the above.
    Other,
}

impl Display for SensorErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Bus => "the bus refused or garbled a transfer",
            Self::Timeout => "no new sample in time",
            Self::Identification => "another chip answered",
            Self::Configuration => "the chip did not accept its configuration",
            Self::SelfTest => "the self test failed",
            Self::Data => "the chip answered with data that cannot be",
            Self::Restarted => "the chip lost its settings",
            Self::Absent => "no chip answered",
            Self::Implausible => "what it measured could not be right: it measures another way now",
            Self::Other => "another error of the sensor",
        })
    }
}

impl Error for SensorErrorKind {}

/// An error of a sensor driver.
pub trait SensorError: Debug {
    /// The part of the error that is the same for every driver.
    fn kind(&self) -> SensorErrorKind;
}

impl SensorError for SensorErrorKind {
    fn kind(&self) -> SensorErrorKind {
        *self
    }
}

impl SensorError for Infallible {
    fn kind(&self) -> SensorErrorKind {
        match *self {}
    }
}
