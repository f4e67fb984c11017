//! How long one transfer may take before its driver gives it up.
//!
//! A constant for all transfers is either too long for a 12-byte read in the flight band or too short for a
//! configuration file on a slow bus. So the limit follows the length. It is wall time: an asynchronous transfer costs
//! the processor its start and its end, and a blocking bus ([`blocking`](crate::blocking)) cannot be given up at all.
//!
//! It begins when the driver asks for the bus, since a driver cannot know when it gets it: so there is a margin for the neighbours. Every driver takes
//! another limit with `with_transfer_limit`. It is not a real-time guarantee: a device may stretch the clock.

use stampfly_types::Duration;

/// A limit as a function of length: so much per byte, and so much for everything else.
///
/// ```
/// use stampfly_driver_core::chip::TransferLimit;
/// use stampfly_types::Duration;
/// assert_eq!(TransferLimit::SPI_SENSORS.of(12), Duration::from_micros(332), "twelve bytes of an inertial sensor");
/// assert!(TransferLimit::SPI_SENSORS.of(256) < Duration::from_millis(1), "a piece of a configuration file");
/// assert!(TransferLimit::I2C_SENSORS.of(17) < Duration::from_millis(12), "a range, a hundred kilohertz, a busy bus");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TransferLimit {
    byte: Duration,
    margin: Duration,
}

impl TransferLimit {
    /// SPI at 1 MHz or more on a bus that is shared with anything: 200 ms for the neighbours' transfers. What every driver on SPI has
    /// unless it is told otherwise.
    pub const SPI: Self = Self { byte: Duration::from_micros(8), margin: Duration::from_micros(200_000) };
    /// SPI at 4 MHz or more, whose owner waits for no more than one short transfer of a neighbour
    /// ([`slot`](crate::slot)): at most 1 ms for everything the drivers here transfer at once.
    pub const SPI_SENSORS: Self = Self { byte: Duration::from_micros(2), margin: Duration::from_micros(300) };
    /// SPI of a guest on a bus with slots: 1 MHz or more, and it waits for its slot, 5 ms when the lead is silent.
    pub const SPI_GUEST: Self = Self { byte: Duration::from_micros(8), margin: Duration::from_micros(9_000) };
    /// I2C at 100 kHz or more, nine clocks to a byte, on a bus that is shared with anything: 200 ms for the neighbours' transfers. A
    /// display's frame of a kilobyte takes 92 ms there. What every driver on I2C has unless it is told
    /// otherwise.
    pub const I2C: Self = Self { byte: Duration::from_micros(90), margin: Duration::from_micros(200_000) };
    /// The same on a bus of sensors alone: 10 ms for the neighbours' transfers, and for one of them that stretches the clock. What hangs is
    /// known twenty times as soon.
    pub const I2C_SENSORS: Self = Self { byte: Duration::from_micros(90), margin: Duration::from_micros(10_000) };
    /// Addresses, dummy byte, command.
    const OVERHEAD: u64 = 4;

    /// The limit of a transfer of so many bytes of data.
    #[must_use]
    pub const fn of(self, bytes: usize) -> Duration {
        let transfer = self.byte.as_micros().saturating_mul((bytes as u64).saturating_add(Self::OVERHEAD));
        Duration::from_micros(self.margin.as_micros().saturating_add(transfer))
    }
}
