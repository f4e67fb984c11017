//! Emulator of the radio nRF24L01+ and its predecessor nRF24L01: Nordic Semiconductor's product
//! specifications, nRF24L01+ v1.0 ("PS" below) and nRF24L01 v2.0, on SPI, with the [radio
//! channel](Air) between several of them.
//!
//! | register | content | after reset | PS |
//! |---|---|---|---|
//! | 0x00 | CONFIG: masks (6:4), CRC (3) of two bytes (2), powered (1), receives (0) | 0x08 | 9.1 |
//! | 0x01, 0x02 | pipes that acknowledge, pipes that are listened to | 0x3F, 0x03 | 9.1 |
//! | 0x03 | bytes of addresses, less 2 | 0x03 | 9.1 |
//! | 0x04 | retransmission: delay (7:4), attempts (3:0) | 0x03 | 9.1 |
//! | 0x05, 0x06 | channel; rate (5, 3) and power (2:1) | 0x02, 0x0E | 9.1 |
//! | 0x07 | STATUS: received (6), sent (5), given up (4), each cleared by a one; pipe (3:1), full (0) | 0x0E | 9.1 |
//! | 0x09 | a carrier was received | 0 | 6.4 |
//! | 0x0A–0x0F, 0x10 | addresses of the pipes, and destination address | E7…, C2…, C3 to C6, E7… | 9.1 |
//! | 0x11–0x16 | bytes of payloads in each pipe, 0 is none | 0 | 9.1 |
//! | 0x17 | FIFOs: outgoing full (5), empty (4), received full (1), empty (0) | 0x11 | 9.1 |
//! | 0x1C, 0x1D | dynamic payload length; features | 0 | 9.1 |
//!
//! | command | | PS table 20 |
//! |---|---|---|
//! | 000A AAAA, 001A AAAA | read, write a register, low byte first | writes only in power down and standby |
//! | 0110 0001 | read a payload and remove it | |
//! | 0110 0000 | its length | |
//! | 1010 0000, 1011 0000 | payload to be sent, without acknowledgement | |
//! | 1110 0001, 1110 0010 | empty the FIFO of outgoing, of received payloads | |
//! | 1111 1111 | nothing | |
//!
//! The first byte out is STATUS. The chip answers 100 ms after power-on (6.1.1), is in standby 4.5
//! ms after being powered up (6.1.7, with the slowest crystal of its table), and listens or sends
//! 130 µs after CE has risen. Packets that begin earlier are not received. A received packet has to
//! match channel, rate, address, length and CRC bit for bit. A packet that arrives while three are
//! waiting to be read is lost (8.4).
//!
//! [`original`](Nrf24l01::original) is the nRF24L01 without the plus: no 250 kbit/s, bit 0 of 0x06
//! is its amplifier, and 0x1C and 0x1D are accessible only after the command 0x50 0x73.
//!
//! *Unverified*: writes to registers while the radio listens or sends are lost, except for STATUS
//! and for a write that powers down; no answer during the power-on reset; missing data read as
//! zeros; a packet with a wrong CRC after a matching address is lost. Table 20 and the registers
//! 0x1C and 0x1D have been compared with the data sheet, the other section and table numbers have
//! not. Not modelled: payloads in acknowledgements, 0x08, reuse of a payload, distance, signal
//! strength.

mod air;
mod frame;
mod pins;
mod radio;
mod registers;

use super::{Chip, SpiChip, SpiPort};
pub use air::{Air, AirPacket};
pub use frame::AirRate;
pub use pins::{ChipEnable, RadioInterrupt};
use radio::{FIFO, Radio};
use registers::{Payload, register};
use stampfly_types::Instant;

const R_RX_PAYLOAD: u8 = 0x61;
const R_RX_PL_WID: u8 = 0x60;
const W_TX_PAYLOAD: u8 = 0xA0;
const W_TX_PAYLOAD_NOACK: u8 = 0xB0;
const FLUSH_TX: u8 = 0xE1;
const FLUSH_RX: u8 = 0xE2;
const ACTIVATE: u8 = 0x50;
/// Longest payload, bytes.
const LONGEST: usize = 32;

/// The emulator.
///
/// ```
/// use embedded_hal::spi::{MODE_0, SpiDevice};
/// use stampfly_sim::chips::{Air, Nrf24l01, SpiBus};
/// use stampfly_sim::time::Clock;
/// use stampfly_types::Instant;
///
/// let clock = Clock::new(Instant::ZERO);
/// let (port, _) = SpiBus::new(&clock, 1).attach(8_000_000, Nrf24l01::new(&Air::new(&clock, 1)));
/// let mut port = port.with_mode(MODE_0);
/// clock.advance_to(Instant::from_millis(100));
/// let mut answer = [0; 6];
/// port.transfer(&mut answer, &[0x0A])?;
/// assert_eq!(answer, [0x0E, 0xE7, 0xE7, 0xE7, 0xE7, 0xE7], "the status, then the address");
/// # Ok::<(), stampfly_sim::chips::BusError>(())
/// ```
#[derive(Debug)]
pub struct Nrf24l01 {
    air: Air,
    number: usize,
    command: u8,
    /// Bytes after the command.
    data: Vec<u8>,
    /// Bytes read after STATUS.
    answer: Vec<u8>,
}

impl Nrf24l01 {
    /// An nRF24L01+ after power-on, with CE low.
    #[must_use]
    pub fn new(air: &Air) -> Self {
        Self::of(air, true)
    }

    /// An nRF24L01 without the plus, after power-on.
    #[must_use]
    pub fn original(air: &Air) -> Self {
        Self::of(air, false)
    }

    fn of(air: &Air, is_plus: bool) -> Self {
        let number = air.join(Radio::new(is_plus, air.clock().now()));
        Self { air: air.clone(), number, command: 0xFF, data: Vec::new(), answer: Vec::new() }
    }

    fn with<T>(&self, now: Instant, act: impl FnOnce(&mut Radio) -> T) -> T {
        self.air.with(self.number, now, act)
    }

    /// Prepares the bytes that follow STATUS.
    fn prepare(&mut self, now: Instant) {
        let command = self.command;
        self.answer = self.with(now, |radio| match command {
            0x00..=0x1F => value(radio, command),
            R_RX_PAYLOAD => radio.received.front().map_or_else(Vec::new, |(_, payload)| payload.clone()),
            R_RX_PL_WID => radio.received.front().map_or_else(Vec::new, |(_, payload)| vec![payload.len() as u8]),
            _ => Vec::new(),
        });
    }

    /// Executes the command when the chip select has risen.
    fn execute(&mut self, now: Instant) {
        let (command, data) = (self.command, core::mem::take(&mut self.data));
        self.with(now, |radio| {
            match command {
                0x20..=0x3F => write(radio, command & 0x1F, &data),
                R_RX_PAYLOAD if !data.is_empty() => {
                    radio.received.pop_front();
                }
                W_TX_PAYLOAD_NOACK if radio.registers.get(register::FEATURE) & 1 == 0 => {}
                W_TX_PAYLOAD | W_TX_PAYLOAD_NOACK if radio.outgoing.len() < FIFO && !data.is_empty() => {
                    let bytes = data.iter().copied().take(LONGEST).collect();
                    radio.outgoing.push_back(Payload { bytes, wants_acknowledgement: command == W_TX_PAYLOAD });
                }
                FLUSH_TX => radio.outgoing.clear(),
                FLUSH_RX => radio.received.clear(),
                ACTIVATE if data.first() == Some(&0x73) && !radio.registers.is_plus && radio.is_idle() => {
                    radio.registers.activated ^= true;
                }
                _ => {}
            }
            radio.settle(now);
        });
    }
}

/// Writes a register (table 20): only in power down and standby, except for flags and for a power
/// down.
fn write(radio: &mut Radio, register: u8, data: &[u8]) {
    let powers_down = register == register::CONFIG && data.first().is_some_and(|config| config & 2 == 0);
    if radio.is_idle() || register == register::STATUS || powers_down {
        radio.registers.write(register, data);
    }
}

fn status(radio: &Radio) -> u8 {
    let pipe = radio.received.front().map_or(7, |(pipe, _)| *pipe);
    radio.registers.flags | pipe << 1 | u8::from(radio.outgoing.len() == FIFO)
}

/// Content of a register.
fn value(radio: &Radio, register: u8) -> Vec<u8> {
    let registers = &radio.registers;
    if let Some(address) = registers.long(register) {
        return address.to_vec();
    }
    vec![match register {
        register::STATUS => status(radio),
        register::OBSERVE_TX => 0,
        register::RPD => u8::from(radio.carrier()),
        register::FIFO_STATUS => {
            let (outgoing, received) = (radio.outgoing.len(), radio.received.len());
            u8::from(outgoing == FIFO) << 5
                | u8::from(outgoing == 0) << 4
                | u8::from(received == FIFO) << 1
                | u8::from(received == 0)
        }
        register::DYNPD | register::FEATURE if !registers.activated => 0,
        _ => registers.short(register).unwrap_or_else(|| registers.get(register)),
    }]
}

impl Chip for Nrf24l01 {
    /// Of an address only the least significant byte.
    fn read(&mut self, register: u16, now: Instant) -> u16 {
        self.with(now, |radio| value(radio, register as u8 & 0x1F).first().copied().map_or(0, u16::from))
    }

    fn write(&mut self, register: u16, value: u16, now: Instant) {
        self.with(now, |radio| {
            write(radio, register as u8 & 0x1F, &[value as u8]);
            radio.settle(now);
        });
    }

    fn reset(&mut self, now: Instant) {
        self.with(now, |radio| radio.reset(now));
    }

    /// Has no effect: the chip has no identity register.
    fn set_id(&mut self, _: u16) {}

    /// Removes the antenna: the radio neither receives nor is received.
    fn set_broken(&mut self, broken: bool) {
        let now = self.air.clock().now();
        self.with(now, |radio| radio.broken = broken);
    }
}

impl SpiChip for Nrf24l01 {
    const HIGHEST_CLOCK: u32 = 10_000_000;

    fn answer(&mut self, index: usize, now: Instant) -> u8 {
        if !self.with(now, |radio| radio.is_up(now)) {
            return 0;
        }
        match index.checked_sub(1) {
            None => self.with(now, |radio| status(radio)),
            Some(0) => {
                self.prepare(now);
                self.answer.first().copied().unwrap_or(0)
            }
            Some(place) => self.answer.get(place).copied().unwrap_or(0),
        }
    }

    fn take(&mut self, index: usize, byte: u8, _: Instant) {
        if index == 0 {
            self.command = byte;
            self.data.clear();
        } else {
            self.data.push(byte);
        }
    }

    fn release(&mut self, now: Instant) {
        if self.with(now, |radio| radio.is_up(now)) {
            self.execute(now);
        }
    }
}

impl SpiPort<Nrf24l01> {
    /// The chip's CE pin, initially low.
    #[must_use]
    pub fn chip_enable(&self) -> ChipEnable {
        let (_, chip) = self.chip();
        let Nrf24l01 { air, number, .. } = &*chip.borrow();
        ChipEnable { air: air.clone(), number: *number }
    }

    /// The chip's interrupt pin.
    #[must_use]
    pub fn radio_interrupt(&self) -> RadioInterrupt {
        let (_, chip) = self.chip();
        let Nrf24l01 { air, number, .. } = &*chip.borrow();
        RadioInterrupt { air: air.clone(), number: *number }
    }
}
