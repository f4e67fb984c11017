//! Pairing packet: "here I am", from a vehicle that looks for a transmitter, to everybody, twice a second.
//!
//! | offset | type | field |
//! |---|---|---|
//! | 0 | u8 | radio channel, 1 to 13 |
//! | 1 | 6 × u8 | the vehicle's address |
//! | 7 | 4 × u8 | AA 55 16 88 |
//!
//! A transmitter looks through the channels until it hears one, and from then on sends control packets to that address.

use crate::Address;

const MARK: [u8; 4] = [0xAA, 0x55, 0x16, 0x88];

/// A vehicle's call for a transmitter.
///
/// ```
/// use stampfly_link::{Address, PairingPacket};
/// let call = PairingPacket { channel: 1, vehicle: Address([0x34, 0x85, 0x18, 0xAB, 0xCD, 0xEF]) };
/// assert_eq!(PairingPacket::decode(&call.to_bytes()), Ok(call));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PairingPacket {
    /// Radio channel the vehicle listens on, 1 to 13.
    pub channel: u8,
    /// The vehicle.
    pub vehicle: Address,
}

/// Why bytes are no pairing packet, in the order it is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PairingError {
    /// Not 11 bytes.
    Length,
    /// The last four bytes are not AA 55 16 88.
    Mark,
    /// No channel from 1 to 13.
    Channel,
    /// An address no single station can have.
    Vehicle,
}

impl core::fmt::Display for PairingError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Length => "not the length of a pairing packet",
            Self::Mark => "not marked as a pairing packet",
            Self::Channel => "no radio channel",
            Self::Vehicle => "no vehicle's address",
        })
    }
}

impl core::error::Error for PairingError {}

impl PairingPacket {
    /// Length on the air.
    pub const LENGTH: usize = 11;

    /// Reads it.
    ///
    /// # Errors
    /// When it is none.
    pub fn decode(bytes: &[u8]) -> Result<Self, PairingError> {
        let bytes: &[u8; Self::LENGTH] = bytes.try_into().map_err(|_| PairingError::Length)?;
        let &[channel, a, b, c, d, e, f, mark @ ..] = bytes;
        if mark != MARK {
            return Err(PairingError::Mark);
        }
        if !(1..=13).contains(&channel) {
            return Err(PairingError::Channel);
        }
        let vehicle = Address([a, b, c, d, e, f]);
        if !vehicle.is_station() {
            return Err(PairingError::Vehicle);
        }
        Ok(Self { channel, vehicle })
    }

    /// Writes it.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; Self::LENGTH] {
        let [a, b, c, d, e, f] = self.vehicle.0;
        let [w, x, y, z] = MARK;
        [self.channel, a, b, c, d, e, f, w, x, y, z]
    }
}
