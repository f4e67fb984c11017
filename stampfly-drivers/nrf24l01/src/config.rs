//! Configuration of an nRF24L01+: rate, power, CRC, addresses. The register codes are in
//! [`codec`](super::codec).

use stampfly_types::Duration;

/// Configuration of the chip. Both ends of a link need the same values, except for the power.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    /// Data rate.
    pub rate: Rate,
    /// Output power.
    pub power: Power,
    /// Length of the CRC. Without a CRC the chip also receives noise.
    pub checksum: Checksum,
    /// Length of an address.
    pub address_bytes: AddressBytes,
    /// Period of status reads without an interrupt pin. The stamp of a packet is late by at most
    /// this time.
    pub poll: Duration,
}

impl Default for Config {
    /// 1 Mbit/s, 0 dBm, CRC of two bytes, address of five, polled ten thousand times a second: the
    /// settings of a HiSKY receiver.
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

/// Data rate (6.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "the names say it")]
pub enum Rate {
    /// Not supported by the nRF24L01: `start` returns an error there.
    Kbit250,
    Mbit1,
    Mbit2,
}

/// Output power, dBm (6.5). Compatible parts of other makers may emit more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "the names say it")]
pub enum Power {
    Minus18,
    Minus12,
    Minus6,
    Zero,
}

/// Length of the CRC in bytes (7.3.5).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "the names say it")]
pub enum Checksum {
    None,
    One,
    Two,
}

/// Length of an address in bytes (7.3.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[expect(missing_docs, reason = "the names say it")]
pub enum AddressBytes {
    Three,
    Four,
    Five,
}

/// Channel and address of received or sent packets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tuning {
    /// Frequency above 2400 MHz in MHz, 0 to 125.
    pub channel: u8,
    /// In the order of the register, least significant byte first. Shorter addresses use the first
    /// bytes.
    pub address: [u8; 5],
}

/// A received packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Packet<const N: usize> {
    /// Time of the status read that found it. Later than the end of the packet by up to the poll
    /// period, or by the processor's response time to the interrupt.
    pub at: stampfly_types::Instant,
    /// Contents of the packet.
    pub payload: [u8; N],
}
