//! Commands, registers and values of the nRF24L01+, from Nordic's product specification 1.0 of September 2008. Where the nRF24L01 before it
//! differs, from its product specification 2.0 of July 2007.

use crate::{AddressBytes, Checksum, Config, Power, Rate};

/// Commands (8.3.1, table 20). A register is read by its address and written by its address with [`WRITE`](command::WRITE) set.
pub mod command {
    /// Writes the register whose address is in the lower five bits. Only in power down and in standby.
    pub const WRITE: u8 = 0x20;
    /// Reads the first received payload, which is gone then.
    pub const R_RX_PAYLOAD: u8 = 0x61;
    /// Stores a payload that is to be sent.
    pub const W_TX_PAYLOAD: u8 = 0xA0;
    /// Empties the FIFO of payloads to be sent.
    pub const FLUSH_TX: u8 = 0xE1;
    /// Empties the FIFO of received payloads.
    pub const FLUSH_RX: u8 = 0xE2;
}

/// Register addresses (9.1, table 28).
pub mod register {
    /// Masks, CRC, power, direction.
    pub const CONFIG: u8 = 0x00;
    /// Pipes that acknowledge.
    pub const EN_AA: u8 = 0x01;
    /// Pipes that are listened to.
    pub const EN_RXADDR: u8 = 0x02;
    /// Bytes of an address, less 2.
    pub const SETUP_AW: u8 = 0x03;
    /// Retransmission.
    pub const SETUP_RETR: u8 = 0x04;
    /// Channel.
    pub const RF_CH: u8 = 0x05;
    /// Rate and power.
    pub const RF_SETUP: u8 = 0x06;
    /// What happened; a one clears the flag in its place.
    pub const STATUS: u8 = 0x07;
    /// Is there a carrier (6.4)? The nRF24L01 calls it CD.
    pub const RPD: u8 = 0x09;
    /// The address of pipe 0.
    pub const RX_ADDR_P0: u8 = 0x0A;
    /// The address that is sent to.
    pub const TX_ADDR: u8 = 0x10;
    /// Bytes of a payload in pipe 0.
    pub const RX_PW_P0: u8 = 0x11;
    /// Pipes whose packets say their length.
    pub const DYNPD: u8 = 0x1C;
    /// Features. Of the nRF24L01, this and [`DYNPD`] are locked, and read as zero, until a command `ACTIVATE` that the nRF24L01+ does not have; the
    /// driver wants both zero, so it needs neither the command nor to know which part it is.
    pub const FEATURE: u8 = 0x1D;
}

/// CONFIG: powered.
pub const POWERED: u8 = 0x02;
/// CONFIG: receives, and does not send.
pub const RECEIVES: u8 = 0x01;
/// STATUS: a payload has been received.
pub const RECEIVED: u8 = 0x40;
/// STATUS: a payload has been sent.
pub const SENT: u8 = 0x20;
/// STATUS: all its flags.
pub const FLAGS: u8 = 0x70;
/// The last channel (9.1, RF_CH; 6.3: at 2 Mbit/s each takes two).
pub const LAST_CHANNEL: u8 = 125;
/// RF_SETUP, bit 0: no matter to the nRF24L01+, the gain of the nRF24L01's receiver, a part of the power of the Si24R1.
const GAIN: u8 = 0x01;

/// CONFIG for a receiver that is powered: all interrupts reach the pin.
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

/// Registers, their values, and which bits of them are compared when they are read back: what does not change while the driver runs.
#[must_use]
pub const fn settings(config: &Config, payload: u8) -> [(u8, u8, u8); 8] {
    [
        (register::SETUP_AW, address_bytes(config.address_bytes) as u8 - 2, 0xFF),
        // No pipe acknowledges and nothing is sent again: without both, packets have no control field (7.10).
        (register::EN_AA, 0, 0xFF),
        (register::SETUP_RETR, 0, 0xFF),
        (register::EN_RXADDR, 1, 0xFF),
        (register::RX_PW_P0, payload, 0xFF),
        (register::DYNPD, 0, 0xFF),
        (register::FEATURE, 0, 0xFF),
        // Without the bit that is no matter, and without the one that says that the frequency is locked.
        (register::RF_SETUP, rf_setup(config.rate, config.power), !(GAIN | 0x10)),
    ]
}

/// How long a packet is on the air, µs: preamble, address, payload, CRC (7.3), without the time until it begins.
#[must_use]
pub const fn airtime(config: &Config, payload: usize) -> u64 {
    let checksum = match config.checksum {
        Checksum::None => 0,
        Checksum::One => 1,
        Checksum::Two => 2,
    };
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
    /// The pipe of the first received payload; `None` when there is none.
    pub pipe: Option<u8>,
}

impl Status {
    /// Takes the register apart; `None` when a chip cannot say so: bit 7 is always zero, and there is no pipe 6.
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
