//! Time limit of one transfer, after which the driver gives it up.
//!
//! One constant for all transfers is either too long for a 12-byte read in the flight band or too
//! short for a configuration file on a slow bus, so the limit follows the length. It is wall time:
//! an asynchronous transfer occupies the processor only at its start and at its end. A driver
//! cannot give up a transfer on a blocking bus ([`blocking`](crate::blocking)) at all.
//!
//! The limit starts when the driver requests the bus, because a driver cannot know when the
//! transfer begins. A margin therefore covers the transfers of other devices on the bus. Every
//! driver on a [`Port`](super::Port) takes another limit with `with_transfer_limit`. The limit is
//! not a real-time guarantee: a device may stretch the clock.

use stampfly_types::Duration;

/// A time limit as a linear function of the transfer's length: a fixed margin and a time per byte.
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
    /// SPI at 1 MHz or more on a bus shared with devices of any kind: 200 ms for their transfers.
    /// The default of every driver on SPI.
    pub const SPI: Self = Self { byte: Duration::from_micros(8), margin: Duration::from_micros(200_000) };
    /// SPI at 4 MHz or more on a bus where the driver waits for at most one short transfer of
    /// another device ([`slot`](crate::slot)). At most 1 ms for the longest transfer of the drivers
    /// in this family.
    pub const SPI_SENSORS: Self = Self { byte: Duration::from_micros(2), margin: Duration::from_micros(300) };
    /// SPI at 1 MHz or more for the guest on a bus with slots. The guest waits for its slot, up to
    /// 5 ms when the lead is silent.
    pub const SPI_GUEST: Self = Self { byte: Duration::from_micros(8), margin: Duration::from_micros(9_000) };
    /// I2C at 100 kHz or more, with nine clocks per byte, on a bus shared with devices of any kind:
    /// 200 ms for their transfers. One frame of a display, 1 kB, takes 92 ms at that rate. The
    /// default of every driver on I2C.
    pub const I2C: Self = Self { byte: Duration::from_micros(90), margin: Duration::from_micros(200_000) };
    /// I2C at 100 kHz or more on a bus with sensors only: 10 ms for the transfers of the others,
    /// clock stretching included. Detects a bus that hangs twenty times faster than
    /// [`I2C`](Self::I2C).
    pub const I2C_SENSORS: Self = Self { byte: Duration::from_micros(90), margin: Duration::from_micros(10_000) };
    /// Bytes of a transfer besides its data: addresses, a dummy byte, a command.
    const OVERHEAD: u64 = 4;

    /// The limit of a transfer of `bytes` bytes of data.
    #[must_use]
    pub const fn of(self, bytes: usize) -> Duration {
        let transfer = self.byte.as_micros().saturating_mul((bytes as u64).saturating_add(Self::OVERHEAD));
        Duration::from_micros(self.margin.as_micros().saturating_add(transfer))
    }
}
