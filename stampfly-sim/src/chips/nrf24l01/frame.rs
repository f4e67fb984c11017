//! A packet as bits on the air: address, control field, payload, CRC (nRF24L01+ product
//! specification, 7.3).
//!
//! All receivers process the same bits, so a receiver with another address width, payload length or
//! CRC rejects the packet as a real radio does.

use stampfly_types::Duration;

/// Data rate on the air.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub enum AirRate {
    Kbit250,
    Mbit1,
    Mbit2,
}

impl AirRate {
    /// Duration of `bits` bits.
    pub(super) const fn of(self, bits: u64) -> Duration {
        Duration::from_micros(match self {
            Self::Kbit250 => 4 * bits,
            Self::Mbit1 => bits,
            Self::Mbit2 => bits.div_ceil(2),
        })
    }
}

/// Content of a packet. Bytes are sent most significant bit first, the address most significant
/// byte first (7.3.2).
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Content<'a> {
    /// In the order of the register: least significant byte first.
    pub address: &'a [u8],
    /// Enhanced ShockBurst's control field, 9 bits (7.3.3); `None` in ShockBurst (7.10).
    pub control: Option<u16>,
    pub payload: &'a [u8],
    /// Length of the CRC, 0 to 2 bytes.
    pub crc: u8,
}

/// Length of the control field, bits.
pub(super) const CONTROL: usize = 9;

impl Content<'_> {
    /// The bits without the preamble.
    pub fn bits(&self) -> Vec<bool> {
        let mut bits = Vec::new();
        self.address.iter().rev().for_each(|byte| push(&mut bits, u16::from(*byte), 8));
        if let Some(control) = self.control {
            push(&mut bits, control, CONTROL);
        }
        self.payload.iter().for_each(|byte| push(&mut bits, u16::from(*byte), 8));
        let sum = checksum(&bits, self.crc);
        push(&mut bits, sum, 8 * usize::from(self.crc));
        bits
    }
}

fn push(bits: &mut Vec<bool>, value: u16, count: usize) {
    bits.extend((0..count).rev().map(|place| value >> place & 1 == 1));
}

/// The number formed by these bits; missing bits are zero.
pub(super) fn number(bits: &[bool], from: usize, count: usize) -> u16 {
    (from..from + count).fold(0, |number, place| number << 1 | u16::from(bits.get(place).copied().unwrap_or(false)))
}

/// CRC over bits (7.3.5): X¹⁶ + X¹² + X⁵ + 1 from FFFF, or X⁸ + X² + X + 1 from FF.
pub(super) fn checksum(bits: &[bool], bytes: u8) -> u16 {
    let (polynomial, start, top) = match bytes {
        0 => return 0,
        1 => (0x07, 0xFF, 7),
        _ => (0x1021, 0xFFFF, 15),
    };
    let mask = start;
    bits.iter().fold(start, |sum: u16, bit| {
        // Bit by bit, because with a control field the data are not whole bytes.
        let out = (sum >> top & 1 == 1) ^ *bit;
        (sum << 1 ^ if out { polynomial } else { 0 }) & mask
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_long_sum_is_the_one_that_catalogues_call_ibm_3740() {
        let mut bits = Vec::new();
        b"123456789".iter().for_each(|byte| push(&mut bits, u16::from(*byte), 8));
        assert_eq!(checksum(&bits, 2), 0x29B1);
        // CRC-8 with the same polynomial and start is catalogued (as ROHC) only with reversed bits:
        // computed by hand for one zero byte.
        assert_eq!(checksum(&[false; 8], 1), 0xF3);
    }

    #[test]
    fn a_packet_is_address_payload_and_sum_from_the_last_byte_of_the_address_on() {
        let content = Content { address: &[1, 2, 3, 4, 0x85], control: None, payload: &[0xAA; 10], crc: 2 };
        let bits = content.bits();
        assert_eq!(bits.len(), 40 + 80 + 16);
        assert_eq!((number(&bits, 0, 8), number(&bits, 32, 8), number(&bits, 40, 8)), (0x85, 1, 0xAA));
        assert_eq!(checksum(&bits[..120], 2), number(&bits, 120, 16));
    }
}
