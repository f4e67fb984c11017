//! Errors of a chip on a bus.

use crate::{SensorError, SensorErrorKind};
use core::error::Error;
use core::fmt::{self, Debug, Display};

/// An error of a chip driver. `E` is the error type of the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ChipError<E> {
    /// The bus reported an error in the transfer.
    Bus(E),
    /// The transfer took longer than its length allows ([`TransferLimit`](super::TransferLimit)),
    /// and the driver gave it up.
    BusTimeout,
    /// The chip answers but made no new sample in time.
    NoSample,
    /// The chip's identification is not the expected one: another chip, or none, is connected.
    Identification {
        /// The identification that was read.
        found: u16,
    },
    /// A pin of the chip could not be set.
    Pin,
    /// Another device answers at the address this chip starts up with, so the driver keeps this
    /// chip in reset.
    AddressTaken,
    /// The configuration passed to the driver is invalid. The driver has written nothing to the
    /// chip.
    InvalidConfiguration,
    /// The chip did not start, or did not keep a setting.
    Configuration {
        /// The chip's status register, or the setting as it was read back.
        status: u8,
    },
    /// The chip lost its configuration since the last call. The next call sets it up again.
    Restarted,
    /// The self test failed: the chip answers, but does not measure.
    SelfTest,
    /// The chip returned invalid data.
    Data,
    /// The measurement was implausible. The driver uses another measuring mode from the next call
    /// on.
    Implausible,
    /// The clock of the [`Timebase`](crate::Timebase) stands still while its delays return, so no
    /// deadline would ever pass.
    ClockStopped,
}

impl<E: Debug> SensorError for ChipError<E> {
    fn kind(&self) -> SensorErrorKind {
        match self {
            Self::Bus(_) => SensorErrorKind::Bus,
            Self::BusTimeout | Self::NoSample => SensorErrorKind::Timeout,
            // All zeros or all ones: the data line is not driven. No supported chip has such an
            // identification.
            Self::Identification { found: 0 | 0xFF | 0xFFFF } => SensorErrorKind::Absent,
            Self::Identification { .. } => SensorErrorKind::Identification,
            Self::InvalidConfiguration | Self::Configuration { .. } | Self::AddressTaken => {
                SensorErrorKind::Configuration
            }
            Self::Restarted => SensorErrorKind::Restarted,
            Self::Pin | Self::ClockStopped => SensorErrorKind::Other,
            Self::SelfTest => SensorErrorKind::SelfTest,
            Self::Data => SensorErrorKind::Data,
            Self::Implausible => SensorErrorKind::Implausible,
        }
    }
}

impl<E: Debug> Display for ChipError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let said = match self {
            Self::Bus(error) => return write!(f, "the bus refused or garbled the transfer: {error:?}"),
            Self::Identification { found } => return write!(f, "another chip answered: it calls itself {found:#x}"),
            Self::Configuration { status } => {
                return write!(f, "the chip did not start or did not keep its settings: it says {status:#04x}");
            }
            Self::BusTimeout => "the transfer took too long and was given up",
            Self::NoSample => "the chip answers but made no new sample in time",
            Self::Pin => "a pin of the chip could not be set",
            Self::AddressTaken => "another chip answers at the address this one starts up with",
            Self::InvalidConfiguration => "the configuration cannot be, nothing was sent",
            Self::Restarted => "the chip lost its settings",
            Self::SelfTest => "the self test failed",
            Self::Data => "the chip answered with data that cannot be",
            Self::Implausible => "what it measured could not be right: it measures another way now",
            Self::ClockStopped => "the clock stands still: what does the time base's `now` return?",
        };
        f.write_str(said)
    }
}

impl<E: Debug> Error for ChipError<E> {}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn what_the_chip_said_is_in_the_words() {
        let error: std::boxed::Box<dyn Error> = std::boxed::Box::new(ChipError::<()>::Identification { found: 0xD1 });
        assert_eq!(error.to_string(), "another chip answered: it calls itself 0xd1");
        let kind = |found| ChipError::<()>::Identification { found }.kind();
        assert_eq!([0, 0xFF, 0xFFFF].map(kind), [SensorErrorKind::Absent; 3]);
        assert_eq!([0x24, 0xFF00].map(kind), [SensorErrorKind::Identification; 2]);
        assert!(ChipError::Bus("no acknowledge").to_string().ends_with("\"no acknowledge\""));
        assert!(ChipError::<()>::Configuration { status: 2 }.to_string().ends_with("0x02"));
    }
}
