//! What the driver of a chip is made of: registers behind any wires, an error, a limit of time, the chip's place on its board.
//!
//! For whoever writes a driver: a [`Port`] reads and writes the registers, and every transfer ends in bounded time. Whoever uses one
//! meets [`ChipError`], [`AxisMap`] and [`TransferLimit`]. Not for a chip without registers; that one has its bus to itself.
//!
//! # What drivers on a port expect of the board
//! A register is written in one piece on I2C, whatever a bus does between the operations of a transaction: Linux and some controllers start
//! again there. On SPI the chip select stays low for a whole transaction, as `SpiDevice` asks.

mod axis;
mod error;
mod limit;
mod port;

pub use axis::{Axis, AxisMap};
pub use error::ChipError;
pub use limit::TransferLimit;
pub use port::{I2cRegisters, Port, Registers, SpiRegisters, Wires, bounded};
