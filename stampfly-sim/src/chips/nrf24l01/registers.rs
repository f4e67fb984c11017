//! Registers of an nRF24L01 (product specification, 9.1, table 28), and payloads in its FIFOs.

/// Register addresses.
pub(super) mod register {
    pub const CONFIG: u8 = 0x00;
    pub const EN_AA: u8 = 0x01;
    pub const EN_RXADDR: u8 = 0x02;
    pub const SETUP_AW: u8 = 0x03;
    pub const SETUP_RETR: u8 = 0x04;
    pub const RF_CH: u8 = 0x05;
    pub const RF_SETUP: u8 = 0x06;
    pub const STATUS: u8 = 0x07;
    pub const OBSERVE_TX: u8 = 0x08;
    pub const RPD: u8 = 0x09;
    pub const RX_ADDR_P5: u8 = 0x0F;
    pub const TX_ADDR: u8 = 0x10;
    pub const RX_PW_P0: u8 = 0x11;
    pub const FIFO_STATUS: u8 = 0x17;
    pub const DYNPD: u8 = 0x1C;
    pub const FEATURE: u8 = 0x1D;
}

/// Flags of STATUS, and their masks in CONFIG.
pub(super) mod flag {
    pub const RX_DR: u8 = 0x40;
    pub const TX_DS: u8 = 0x20;
    pub const MAX_RT: u8 = 0x10;
    pub const ALL: u8 = 0x70;
}

/// Values after reset from CONFIG on, without addresses and read-only registers.
const AFTER_RESET: [(u8, u8); 7] = [
    (register::CONFIG, 0x08),
    (register::EN_AA, 0x3F),
    (register::EN_RXADDR, 0x03),
    (register::SETUP_AW, 0x03),
    (register::SETUP_RETR, 0x03),
    (register::RF_CH, 0x02),
    (register::RF_SETUP, 0x0E),
];

/// A payload to send.
#[derive(Clone, Debug, Default)]
pub(super) struct Payload {
    pub bytes: Vec<u8>,
    pub wants_acknowledgement: bool,
}

#[derive(Clone, Debug)]
pub(super) struct Registers {
    pub is_plus: bool,
    /// Flags of STATUS.
    pub flags: u8,
    /// Features are accessible; on the original part after ACTIVATE.
    pub activated: bool,
    bytes: [u8; 32],
    /// Addresses of pipes 0 and 1, and the destination address.
    long: [[u8; 5]; 3],
    /// Least significant address bytes of pipes 2 to 5.
    short: [u8; 4],
}

impl Registers {
    pub fn new(is_plus: bool) -> Self {
        let mut bytes = [0; 32];
        for (register, value) in AFTER_RESET {
            bytes[usize::from(register)] = value;
        }
        if !is_plus {
            // Bit 0 is the gain of its low-noise amplifier (nRF24L01 product specification 2.0,
            // 9.1).
            bytes[usize::from(register::RF_SETUP)] = 0x0F;
        }
        Self {
            is_plus,
            flags: 0,
            activated: is_plus,
            bytes,
            long: [[0xE7; 5], [0xC2; 5], [0xE7; 5]],
            short: [0xC3, 0xC4, 0xC5, 0xC6],
        }
    }

    /// Content of a writable one-byte register.
    pub fn get(&self, register: u8) -> u8 {
        self.bytes[usize::from(register & 0x1F)]
    }

    /// Writes a register, least significant byte first (8.3.1).
    pub fn write(&mut self, register: u8, data: &[u8]) {
        let Some(first) = data.first() else { return };
        match register {
            register::STATUS => self.flags &= !(first & flag::ALL),
            0x0A | 0x0B | register::TX_ADDR => {
                let place = if register == register::TX_ADDR { 2 } else { usize::from(register - 0x0A) };
                self.long[place].iter_mut().zip(data).for_each(|(place, byte)| *place = *byte);
            }
            0x0C..=register::RX_ADDR_P5 => self.short[usize::from(register - 0x0C)] = *first,
            _ => self.bytes[usize::from(register & 0x1F)] = first & self.writable(register),
        }
    }

    /// Writable bits; undefined bits read as zero (9.1).
    const fn writable(&self, register: u8) -> u8 {
        match register {
            register::CONFIG | register::RF_CH => 0x7F,
            register::EN_AA | register::EN_RXADDR | 0x11..=0x16 => 0x3F,
            register::SETUP_AW => 0x03,
            register::SETUP_RETR => 0xFF,
            register::RF_SETUP if self.is_plus => 0xBE,
            register::RF_SETUP => 0x1F,
            register::DYNPD if self.activated => 0x3F,
            register::FEATURE if self.activated => 0x07,
            _ => 0,
        }
    }

    /// Content of a five-byte register; `None` for others.
    pub fn long(&self, register: u8) -> Option<[u8; 5]> {
        match register {
            0x0A | 0x0B => Some(self.long[usize::from(register - 0x0A)]),
            register::TX_ADDR => Some(self.long[2]),
            _ => None,
        }
    }

    /// Content of a register with the least significant byte of an address; `None` for others.
    pub fn short(&self, register: u8) -> Option<u8> {
        matches!(register, 0x0C..=register::RX_ADDR_P5).then(|| self.short[usize::from(register - 0x0C)])
    }

    /// Length of addresses, bytes; 0 for an illegal setting.
    fn width(&self) -> usize {
        match self.get(register::SETUP_AW) {
            0 => 0,
            width => usize::from(width) + 2,
        }
    }

    /// The destination address.
    pub fn sends_to(&self) -> Vec<u8> {
        self.long[2][..self.width()].to_vec()
    }

    /// Address of a pipe. Pipes 2 to 5 share all but the least significant byte with pipe 1 (7.7).
    pub fn address(&self, pipe: u8) -> Vec<u8> {
        let mut address = if pipe == 0 { self.long[0] } else { self.long[1] };
        if let Some(lowest) = usize::from(pipe).checked_sub(2).and_then(|place| self.short.get(place)) {
            address[0] = *lowest;
        }
        address[..self.width()].to_vec()
    }

    /// Payload length of this pipe, bytes; `None` for dynamic length (7.3.4).
    pub fn payload_width(&self, pipe: u8) -> Option<u8> {
        let says = self.get(register::FEATURE) & 4 != 0 && self.get(register::DYNPD) >> pipe & 1 != 0;
        (!says).then(|| self.get(register::RX_PW_P0 + pipe))
    }
}
