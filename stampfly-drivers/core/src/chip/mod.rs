//! Building blocks of a chip driver: register access, errors, transfer limits and mounting.
//!
//! For authors of drivers: a [`Port`] reads and writes registers, and every transfer ends in
//! bounded time. Users of a driver meet [`ChipError`], [`AxisMap`] and [`TransferLimit`]. For a
//! chip without registers use [`bounded`] on the bus directly.
//!
//! # Requirements on the board
//! On I2C a port writes register and data as one message, because Linux and some controllers send a
//! repeated start between the operations of a transaction. On SPI the chip select must stay low for
//! a whole transaction, as the contract of `SpiDevice` requires.

mod axis;
mod error;
mod limit;
mod port;

pub use axis::{Axis, AxisMap};
pub use error::ChipError;
pub use limit::TransferLimit;
pub use port::{I2cRegisters, Port, Registers, SpiRegisters, Wires, bounded};
