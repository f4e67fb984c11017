//! Register-level emulators of sensor and radio chips on simulated buses.
//!
//! A driver on these buses exchanges the same bytes as with the board: the chips count conversions,
//! require their start-up sequences and waiting times, and answer a wrong sequence as the hardware
//! does. Their measurements have the same physics as the models in [`sensors`](crate::sensors), and
//! the same seed gives the same specimen in both. Use the emulators to test drivers; to test the
//! flight stack use the models, which skip registers and bus.
//!
//! The emulators follow the manufacturers' data sheets, as far as publicly quoted, and are
//! independent of this project's drivers, so that a misreading is not repeated. Register tables
//! name their section. Facts without a public source are marked *unverified*. All section and table
//! numbers are unverified except BMP280 3.11 and 8, INA3221 8.4 and 8.6, and the nRF24L01+'s table
//! 20 and the last part of its table of registers, which have been compared with the data sheets.
//!
//! | emulator | bus | address or highest clock | data sheet |
//! |---|---|---|---|
//! | [`Bmp280`] | [`I2cBus`], or [`SpiBus`] | 0x76, or up to 10 MHz | BST-BMP280-DS001 |
//! | [`Ina3221`] | [`I2cBus`] | 0x40 | SBOS576 |
//! | [`Bmi270`] | [`SpiBus`], or [`I2cBus`] | up to 10 MHz, or 0x68 | BST-BMI270-DS000 |
//! | [`Bmm150`] | [`I2cBus`], or [`SpiBus`] | 0x10, or up to 10 MHz | BST-BMM150-DS001 |
//! | [`Pmw3901`] | [`SpiBus`] | up to 2 MHz | PixArt PMW3901MB |
//! | [`Vl53l3cx`] | [`I2cBus`] | 0x29, can be moved | ST DS13204 |
//! | [`Mpu6000`] | [`SpiBus`] | up to 1 MHz, its data 20 MHz | InvenSense RM-MPU-6000A, PS-MPU-6000A |
//! | [`Nrf24l01`] | [`SpiBus`], and the [`Air`] | up to 10 MHz | Nordic nRF24L01+ v1.0 |
//!
//! | fault | function |
//! |---|---|
//! | dead chip, refused transfers, bit errors, clock stretching | [`Faults`] |
//! | reset in operation, another part, broken sensing element | [`Attached`] |
//! | wrong mounting, covered sensor, another shunt | [`Flaw`] |
//! | data line held low by a chip, or shorted to ground | [`I2cBus::hold_sda`], [`I2cBus::short_sda`] |
//! | data line from the chips stuck | [`SpiBus::hold_miso`] |
//! | packets lost, channels jammed | [`Air`] |
//! | undriven chip select | [`SpiBus::attach_floating`] |
//! | wrong idle level, clock mode or bit order | [`SpiBus::set_controller`], [`SpiPort::with_mode`], [`SpiPort::with_order`] |
//! | software latency | [`SpiBus::set_latency`], [`I2cBus::set_latency`] |

mod bmi270;
mod bmm150;
mod bmp280;
mod board;
mod fault;
mod i2c;
mod ina3221;
mod latency;
mod lines;
pub(crate) mod mpu6000;
mod nrf24l01;
mod pmw3901;
mod spi;
mod vl53l3cx;

pub use bmi270::{Bmi270, InterruptPin};
pub use bmm150::Bmm150;
pub use bmp280::Bmp280;
pub use board::{AttachedChips, Board, SpiSetup, stand_in_image};
pub use fault::{Attached, Faults, Flaw, Nonsense};
pub use i2c::I2cBus;
pub use ina3221::Ina3221;
pub use latency::Latency;
pub use lines::{ClockLine, DataLine};
pub use mpu6000::Mpu6000;
pub use nrf24l01::{Air, AirPacket, AirRate, ChipEnable, Nrf24l01, RadioInterrupt};
pub use pmw3901::Pmw3901;
pub use spi::{Analyser, BitOrder, Controller, Seen, SpiBus, SpiPort};
pub use vl53l3cx::{ShutdownPin, Vl53l3cx};

use core::cell::Cell;
use core::fmt;
use embedded_hal::i2c::NoAcknowledgeSource;
use embedded_hal::{i2c as hal_i2c, spi as hal_spi};
use stampfly_types::{Duration, Instant};
use std::rc::Rc;

/// Registers of a chip. Calls have ascending instants.
///
/// Addresses and values are wide enough for every chip; a chip with 8-bit registers uses the lower
/// half.
pub trait Chip: fmt::Debug {
    /// Reads a register, with the side effects of reading. Registers that do not exist read as
    /// zero.
    fn read(&mut self, register: u16, now: Instant) -> u16;
    /// Writes a register. Writes to registers that do not exist or are read-only are ignored.
    fn write(&mut self, register: u16, value: u16, now: Instant);
    /// Power-on reset.
    fn reset(&mut self, now: Instant);
    /// Replaces the content of the identity register.
    fn set_id(&mut self, id: u16);
    /// Breaks or repairs the sensing element: the chip answers as before but measures nothing, and
    /// its self-tests or those of its driver fail. Each emulator documents the effect; chips
    /// without a sensing element ignore it.
    fn set_broken(&mut self, _broken: bool) {}
    /// Sets or removes a flaw. Flaws that do not apply to the chip are ignored.
    fn set_flaw(&mut self, _flaw: Option<Flaw>) {}
}

/// A chip on an [`I2cBus`]: maps bytes to registers.
pub trait I2cChip: Chip {
    /// The present address; `None` while the chip is held in reset. Most chips keep the address to
    /// which they were soldered.
    fn address(&self, soldered: u8) -> Option<u8> {
        Some(soldered)
    }
    /// Connects the chip to a bus that is busy until the given instant, for chips that are
    /// sensitive to bus traffic when they start.
    fn wire(&mut self, _busy_until: &Rc<Cell<Instant>>) {}
    /// Receives byte `index` after a (repeated) start in write direction. Returns `false` for no
    /// acknowledge.
    fn receive(&mut self, index: usize, byte: u8, now: Instant) -> bool;
    /// Sends byte `index` after a (repeated) start in read direction.
    fn send(&mut self, index: usize, now: Instant) -> u8;
    /// The stop condition: the transfer is over.
    fn stop(&mut self, _now: Instant) {}
}

/// A chip on an [`SpiBus`].
pub trait SpiChip: Chip {
    /// The fastest clock that the chip allows, Hz.
    const HIGHEST_CLOCK: u32;
    /// The byte that the chip shifts out during byte `index` since it was selected. Called once per
    /// byte before the first bit is sampled, when the incoming byte is not known yet. All ones if
    /// the chip does not drive its line.
    fn answer(&mut self, _index: usize, _now: Instant) -> u8 {
        0xFF
    }
    /// Receives byte `index`.
    fn take(&mut self, _index: usize, _byte: u8, _now: Instant) {}
    /// Exchanges byte `index`, where clock polarity does not matter.
    fn exchange(&mut self, index: usize, byte: u8, now: Instant) -> u8 {
        let answer = self.answer(index, now);
        self.take(index, byte, now);
        answer
    }
    /// Chip select goes high.
    fn release(&mut self, now: Instant);
}

/// Why a transfer failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum BusError {
    /// The address or a data byte was not acknowledged. I²C only.
    NoAcknowledge(NoAcknowledgeSource),
    /// A chip holds the data line low, so no start condition is possible. I²C only.
    ArbitrationLost,
    /// The processor's controller has lost bytes. SPI only.
    Overrun,
}

impl fmt::Display for BusError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoAcknowledge(_) => "no acknowledge",
            Self::ArbitrationLost => "data line held low",
            Self::Overrun => "controller overrun",
        })
    }
}

impl core::error::Error for BusError {}

impl hal_i2c::Error for BusError {
    fn kind(&self) -> hal_i2c::ErrorKind {
        match self {
            Self::NoAcknowledge(source) => hal_i2c::ErrorKind::NoAcknowledge(*source),
            Self::ArbitrationLost => hal_i2c::ErrorKind::ArbitrationLoss,
            Self::Overrun => hal_i2c::ErrorKind::Overrun,
        }
    }
}

impl hal_spi::Error for BusError {
    fn kind(&self) -> hal_spi::ErrorKind {
        match self {
            Self::Overrun => hal_spi::ErrorKind::Overrun,
            Self::NoAcknowledge(_) | Self::ArbitrationLost => hal_spi::ErrorKind::Other,
        }
    }
}

/// The instant `nanoseconds` after `start`, rounded down to microseconds, the clock's resolution.
fn after(start: Instant, nanoseconds: u64) -> Instant {
    start + Duration::from_micros(nanoseconds / 1_000)
}
