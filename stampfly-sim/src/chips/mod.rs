//! The StampFly's chips at register level, behind simulated buses.
//!
//! A driver that talks to these buses exchanges the bytes it would exchange with the board: the chips count
//! conversions, want their start-up sequences and waiting times, and answer a wrong order as the hardware would.
//! What they measure comes from the same physics as the models in [`sensors`](crate::sensors): the same seed is the
//! same specimen in both. Use this to test drivers; to test everything behind the drivers use the models, which skip
//! the bytes and the bus.
//!
//! The emulators follow the makers' data sheets, as far as those are publicly quoted, and none of this project's
//! drivers, so that a misreading is not made twice. Every register table names its section. What no public source
//! confirms is marked *unverified*; so are all section and table numbers except BMP280 3.11 and 8, INA3221 8.4
//! and 8.6, and the nRF24L01+'s table 20 and the last part of its table of registers, which have been compared with the sheets.
//!
//! | emulator | bus | address or clock | data sheet |
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
//! | fault | where |
//! |---|---|
//! | dead chip, refused transfers, bit errors, clock stretching | [`Faults`] |
//! | reset in flight, another part, a sensing element that is broken | [`Attached`] |
//! | soldered otherwise, covered, another shunt | [`Flaw`] |
//! | data line held low by a chip, or shorted to ground | [`I2cBus::hold_sda`], [`I2cBus::short_sda`] |
//! | data line from the chips stuck | [`SpiBus::hold_miso`] |
//! | packets lost, channels jammed | [`Air`] |
//! | chip select that nobody drives yet | [`SpiBus::attach_floating`] |
//! | clock at the wrong level, wrong mode, wrong order of bits | [`SpiBus::set_controller`], [`SpiPort::with_mode`], [`SpiPort::with_order`] |
//! | software that takes its time | [`SpiBus::set_latency`], [`I2cBus::set_latency`] |

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

/// A chip as its registers. Time is an argument and does not go back.
///
/// Both numbers are wide enough for every chip; one with 8-bit registers uses the lower half.
pub trait Chip: fmt::Debug {
    /// Reads a register, with whatever this does to the chip. Registers that do not exist read as zero.
    fn read(&mut self, register: u16, now: Instant) -> u16;
    /// Writes a register. Registers that do not exist or cannot be written swallow the value.
    fn write(&mut self, register: u16, value: u16, now: Instant);
    /// Power-on reset.
    fn reset(&mut self, now: Instant);
    /// Changes what the identity register says.
    fn set_id(&mut self, id: u16);
    /// Breaks or mends the sensing element: the chip answers as before but feels nothing, and its self tests, or those of
    /// its driver, fail. Every emulator says what that looks like; a chip that feels nothing anyway takes no notice.
    fn set_broken(&mut self, _broken: bool) {}
    /// Gives it a flaw, or mends it. A chip to which it cannot happen takes no notice.
    fn set_flaw(&mut self, _flaw: Option<Flaw>) {}
}

/// A chip that can sit on an [`I2cBus`]: how it maps bytes to registers.
pub trait I2cChip: Chip {
    /// The address the chip answers to now; `None` when it is held in reset. Most chips keep the one they were
    /// soldered to.
    fn address(&self, soldered: u8) -> Option<u8> {
        Some(soldered)
    }
    /// Soldered to a bus that is busy until this instant: for chips that mind what goes on there when they start.
    fn wire(&mut self, _busy_until: &Rc<Cell<Instant>>) {}
    /// Takes byte number `index` after a (repeated) start in write direction. `false` is no acknowledge.
    fn receive(&mut self, index: usize, byte: u8, now: Instant) -> bool;
    /// Gives byte number `index` after a (repeated) start in read direction.
    fn send(&mut self, index: usize, now: Instant) -> u8;
    /// The transfer is over.
    fn stop(&mut self, _now: Instant) {}
}

/// A chip that can sit on an [`SpiBus`].
pub trait SpiChip: Chip {
    /// The fastest clock that the chip allows, Hz.
    const HIGHEST_CLOCK: u32;
    /// What the chip shifts out while byte number `index` since it was selected comes in: it does not know that one yet. Asked once a byte,
    /// when the first bit is looked at. All ones where the chip does not drive its line.
    fn answer(&mut self, _index: usize, _now: Instant) -> u8 {
        0xFF
    }
    /// Byte number `index` has come in.
    fn take(&mut self, _index: usize, _byte: u8, _now: Instant) {}
    /// Takes and gives byte number `index`, where polarity plays no part.
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
    /// Nobody acknowledged the address or a data byte. I²C only.
    NoAcknowledge(NoAcknowledgeSource),
    /// The data line is held low by a chip, so no start condition can be made. I²C only.
    ArbitrationLost,
    /// The processor's controller lost bytes. SPI only.
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

/// An instant `nanoseconds` after `start`, counted in whole microseconds like everything on the virtual clock.
fn after(start: Instant, nanoseconds: u64) -> Instant {
    start + Duration::from_micros(nanoseconds / 1_000)
}
