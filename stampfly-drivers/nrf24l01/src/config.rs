//! What an nRF24L01 is told: rate, power, CRC, addresses. How the registers say it is in [`codec`](super::codec).

use stampfly_types::Duration;

/// What the chip is told to do, the same at both ends of the link but for the power.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// Bits per second.
    pub rate: Rate,
    /// Of what is sent.
    pub power: Power,
    /// Bytes of the CRC. Without one, noise is received as well.
    pub checksum: Checksum,
    /// Bytes of an address.
    pub address_bytes: AddressBytes,
    /// How often the chip is asked, where its interrupt is not wired. A packet is stamped that much late at most.
    pub poll: Duration,
}

impl Default for Config {
    /// 1 Mbit/s, 0 dBm, two bytes of CRC, five of address, asked ten thousand times a second: a HiSKY receiver's.
    fn default() -> Self {
        Self {
            rate: Rate::Mbit1,
            power: Power::Zero,
            checksum: Checksum::Two,
            address_bytes: AddressBytes::Five,
            poll: Duration::from_micros(100),
        }
    }
}

/// Bits per second (6.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "the names say it")]
pub enum Rate {
    /// The nRF24L01 without the plus does not have it: a start ends with an error there.
    Kbit250,
    Mbit1,
    Mbit2,
}

/// Output power, dBm (6.5). Clones give more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "the names say it")]
pub enum Power {
    Minus18,
    Minus12,
    Minus6,
    Zero,
}

/// Bytes of the CRC (7.3.5).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "the names say it")]
pub enum Checksum {
    None,
    One,
    Two,
}

/// Bytes of an address (7.3.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "the names say it")]
pub enum AddressBytes {
    Three,
    Four,
    Five,
}

/// Where a radio listens, or sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tuning {
    /// 2400 MHz and so many, 0 to 125.
    pub channel: u8,
    /// In the order of the register: the first byte is the least significant. Of an address of three or four bytes, the first ones.
    pub address: [u8; 5],
}

/// A packet that was received.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Packet<const N: usize> {
    /// When the driver knew of it: after the packet's end by the poll, or by what the processor takes to answer the interrupt.
    pub at: stampfly_types::Instant,
    /// What is in it.
    pub payload: [u8; N],
}
