//! An SPI bus on virtual time: one [`SpiPort`] per chip select, each with its own clock rate.
//!
//! Time works as on [`I2cBus`](super::I2cBus): a transfer costs its bits and its delays, and no other chip gets the
//! bus meanwhile. What software takes for it is [`Latency`], which is zero unless somebody asks.
//!
//! Each port has its mode and its order of bits, and the bus its [`Controller`]. While they agree with the chip, whole bytes are moved;
//! otherwise the [wire] goes from edge to edge, and a chip gets the bytes that its edges make.

mod analyser;
mod bus;
mod chip_end;
mod port;
mod wire;

pub use analyser::{Analyser, Seen};
pub use bus::SpiBus;
pub use port::SpiPort;
pub use wire::{BitOrder, Controller};
