//! SPI bus on virtual time: one [`SpiPort`] per chip select, each with its own clock rate.
//!
//! Timing is as on [`I2cBus`](super::I2cBus): a transfer occupies the bus for its bits and delays.
//! Software latency is set by [`Latency`](super::Latency) and zero by default.
//!
//! Each port has its clock mode and bit order, and the bus its [`Controller`]. If they match the
//! chip, whole bytes are moved; otherwise the [wire] is simulated edge by edge, and the chip
//! receives the bytes that result from its edges.

mod analyser;
mod bus;
mod chip_end;
mod port;
mod wire;

pub use analyser::{Analyser, Seen};
pub use bus::SpiBus;
pub use port::SpiPort;
pub use wire::{BitOrder, Controller};
