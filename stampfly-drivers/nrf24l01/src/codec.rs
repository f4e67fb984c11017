//! Commands, registers and values of the nRF24L01+, from Nordic's product specification 1.0
//! (September 2008), and differences of the older nRF24L01, from its product specification 2.0
//! (July 2007).

use crate::{AddressBytes, Checksum, Config, Power, Rate};

/// Commands (8.3.1, table 20). A register is read with its address as command, and written with its
/// address and [`WRITE`](command::WRITE).
pub mod command {
    /// Writes the register whose address is in the lower five bits. Allowed only in power down and
    /// standby.
    pub const WRITE: u8 = 0x20;
    /// Reads the oldest received payload and removes it.
    pub const R_RX_PAYLOAD: u8 = 0x61;
    /// Stores a payload for sending.
    pub const W_TX_PAYLOAD: u8 = 0xA0;
    /// Empties the send FIFO.
    pub const FLUSH_TX: u8 = 0xE1;
    /// Empties the receive FIFO.
    pub const FLUSH_RX: u8 = 0xE2;
}

/// Register addresses (9.1, table 28).
pub mod register {
    /// Interrupt masks, CRC, power, direction.
    pub const CONFIG: u8 = 0x00;
    /// Pipes with automatic acknowledgement.
    pub const EN_AA: u8 = 0x01;
    /// Enabled receive pipes.
    pub const EN_RXADDR: u8 = 0x02;
    /// Length of an address in bytes, less 2.
    pub const SETUP_AW: u8 = 0x03;
    /// Automatic retransmission.
    pub const SETUP_RETR: u8 = 0x04;
    /// Channel.
    pub const RF_CH: u8 = 0x05;
    /// Data rate and power.
    pub const RF_SETUP: u8 = 0x06;
    /// Status flags; writing a one clears a flag.
    pub const STATUS: u8 = 0x07;
    /// Carrier detection (6.4). Called CD on the nRF24L01.
    pub const RPD: u8 = 0x09;
    /// Address of pipe 0.
    pub const RX_ADDR_P0: u8 = 0x0A;
    /// Address of sent packets.
    pub const TX_ADDR: u8 = 0x10;
    /// Length of a payload in pipe 0, bytes.
    pub const RX_PW_P0: u8 = 0x11;
    /// Pipes with payloads of variable length.
    pub const DYNPD: u8 = 0x1C;
    /// Optional features. On the nRF24L01, this register and [`DYNPD`] are locked, and read as
    /// zero, until a command `ACTIVATE` that the nRF24L01+ does not have. The driver needs both at
    /// zero, so it neither sends the command nor distinguishes the parts.
    pub const FEATURE: u8 = 0x1D;
}

/// CONFIG: powered up.
pub const POWERED: u8 = 0x02;
/// CONFIG: receiver instead of transmitter.
pub const RECEIVES: u8 = 0x01;
/// STATUS: a payload has been received.
pub const RECEIVED: u8 = 0x40;
/// STATUS: a payload has been sent.
pub const SENT: u8 = 0x20;
/// STATUS: all flags.
pub const FLAGS: u8 = 0x70;
/// Highest channel (9.1, RF_CH). At 2 Mbit/s a packet occupies two channels (6.3).
pub const LAST_CHANNEL: u8 = 125;
/// RF_SETUP, bit 0: ignored by the nRF24L01+, receiver gain of the nRF24L01, part of the power
/// setting of the Si24R1.
const GAIN: u8 = 0x01;

/// CONFIG of a receiver that is powered up, with all interrupts enabled on the pin.
#[must_use]
pub const fn configuration(checksum: Checksum) -> u8 {
    let checksum = match checksum {
        Checksum::None => 0,
        Checksum::One => 0x08,
        Checksum::Two => 0x0C,
    };
    checksum | POWERED | RECEIVES
}

/// RF_SETUP.
#[must_use]
pub const fn rf_setup(rate: Rate, power: Power) -> u8 {
    let rate = match rate {
        Rate::Kbit250 => 0x20,
        Rate::Mbit1 => 0,
        Rate::Mbit2 => 0x08,
    };
    let power = match power {
        Power::Minus18 => 0,
        Power::Minus12 => 1,
        Power::Minus6 => 2,
        Power::Zero => 3,
    };
    rate | power << 1 | GAIN
}

/// Bytes of an address.
#[must_use]
pub const fn address_bytes(bytes: AddressBytes) -> usize {
    match bytes {
        AddressBytes::Three => 3,
        AddressBytes::Four => 4,
        AddressBytes::Five => 5,
    }
}

/// Registers with their values, and a mask of the bits that are compared at read-back. They do not
/// change while the driver runs.
#[must_use]
pub const fn settings(config: &Config, payload: u8) -> [(u8, u8, u8); 8] {
    [
        (register::SETUP_AW, address_bytes(config.address_bytes) as u8 - 2, 0xFF),
        // No acknowledgement and no retransmission: packets then have no control field (7.10).
        (register::EN_AA, 0, 0xFF),
        (register::SETUP_RETR, 0, 0xFF),
        (register::EN_RXADDR, 1, 0xFF),
        (register::RX_PW_P0, payload, 0xFF),
        (register::DYNPD, 0, 0xFF),
        (register::FEATURE, 0, 0xFF),
        // Ignores the gain bit and the test bit that locks the synthesizer (PLL_LOCK).
        (register::RF_SETUP, rf_setup(config.rate, config.power), !(GAIN | 0x10)),
    ]
}

/// Time of a packet on the air, µs: preamble, address, payload, CRC (7.3), without the start-up of
/// the transmitter.
#[must_use]
pub const fn airtime(config: &Config, payload: usize) -> u64 {
    let checksum = match config.checksum {
        Checksum::None => 0,
        Checksum::One => 1,
        Checksum::Two => 2,
    };
    // The preamble is one byte.
    let bits = 8 * (1 + address_bytes(config.address_bytes) + payload + checksum) as u64;
    match config.rate {
        Rate::Kbit250 => 4 * bits,
        Rate::Mbit1 => bits,
        Rate::Mbit2 => bits.div_ceil(2),
    }
}

/// STATUS (9.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Status {
    /// A payload has been received since the flag was cleared.
    pub received: bool,
    /// A payload has been sent since the flag was cleared.
    pub sent: bool,
    /// Pipe of the oldest received payload; `None` when there is no payload.
    pub pipe: Option<u8>,
}

impl Status {
    /// Decodes the register. `None` for values that no chip returns: bit 7 is always zero, and pipe
    /// 6 does not exist.
    #[must_use]
    pub const fn decode(status: u8) -> Option<Self> {
        let pipe = status >> 1 & 7;
        if status & 0x80 != 0 || pipe == 6 {
            return None;
        }
        let pipe = if pipe == 7 { None } else { Some(pipe) };
        Some(Self { received: status & RECEIVED != 0, sent: status & SENT != 0, pipe })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_what_a_hisky_receiver_tells_the_chip() {
        let config = Config::default();
        assert_eq!(configuration(config.checksum), 0x0F);
        let values = settings(&config, 10).map(|(register, value, _)| (register, value));
        assert_eq!(values, [(3, 3), (1, 0), (4, 0), (2, 1), (0x11, 10), (0x1C, 0), (0x1D, 0), (6, 0x07)]);
        assert_eq!(airtime(&config, 10), 144);
    }

    #[test]
    fn rates_and_powers_are_those_of_the_table() {
        use Power::{Minus6, Minus12, Minus18, Zero};
        use Rate::{Kbit250, Mbit1, Mbit2};
        let setups = [(Kbit250, Minus18), (Mbit1, Minus12), (Mbit2, Minus6), (Mbit2, Zero)];
        assert_eq!(setups.map(|(rate, power)| rf_setup(rate, power)), [0x21, 0x03, 0x0D, 0x0F]);
        let config = Config { rate: Kbit250, ..Config::default() };
        assert_eq!(airtime(&config, 32), 1_280, "the longest");
    }

    #[test]
    fn a_status_that_no_chip_says_is_refused() {
        assert_eq!(Status::decode(0x0E), Some(Status { received: false, sent: false, pipe: None }), "after reset");
        assert_eq!(Status::decode(0x40), Some(Status { received: true, sent: false, pipe: Some(0) }));
        assert_eq!(Status::decode(0x2E), Some(Status { received: false, sent: true, pipe: None }));
        assert_eq!([0xFF, 0x8E, 0x0C, 0x4D].map(Status::decode), [None; 4]);
    }
}
