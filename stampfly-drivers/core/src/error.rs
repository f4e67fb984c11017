//! Kinds of sensor errors that a program can act on.
//!
//! Every driver has its own error type with details. [`SensorError::kind`] reduces it to what all
//! drivers have in common, like `kind` in `embedded-hal`.

use core::convert::Infallible;
use core::error::Error;
use core::fmt::{self, Debug, Display};

/// The kind of a sensor error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SensorErrorKind {
    /// The bus reported an error in a transfer.
    Bus,
    /// No new sample within the time the sensor specifies, or a transfer that took too long.
    Timeout,
    /// Another chip answered.
    Identification,
    /// The chip did not accept its configuration.
    Configuration,
    /// The chip's self test failed.
    SelfTest,
    /// The chip returned invalid data.
    Data,
    /// The chip lost its configuration; the next call sets it up again.
    Restarted,
    /// No chip answered: the data line read all ones or all zeros, as it does when it is not
    /// driven.
    Absent,
    /// The measurement was implausible; the driver uses another measuring mode from the next call
    /// on.
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
    /// The kind of this error, common to all drivers.
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
