//! Commands on SPI: a byte, and what goes with it.

use crate::codec::command;
use embedded_hal_async::spi::{Operation, SpiDevice};
use stampfly_driver_core::chip::{Registers, TransferLimit, Wires};

/// The chip's commands as registers: an address below 0x20 is a register, everything else a command of its own.
#[derive(Debug)]
pub(crate) struct Commands<S>(pub S);

impl<S: SpiDevice> Registers for Commands<S> {
    type Error = S::Error;
    const LIMIT: TransferLimit = TransferLimit::SPI;
    /// The longest payload.
    const LONGEST_WRITE: usize = 32;

    async fn read(&mut self, command: u8, into: &mut [u8]) -> Result<(), S::Error> {
        self.0.transaction(&mut [Operation::Write(&[command]), Operation::Read(into)]).await
    }

    async fn write(&mut self, command: u8, data: &[u8]) -> Result<(), S::Error> {
        // All commands that write have the bit.
        self.0.transaction(&mut [Operation::Write(&[command | command::WRITE]), Operation::Write(data)]).await
    }
}

impl<S> Wires for Commands<S> {
    type Bus = S;

    fn release(self) -> S {
        self.0
    }
}
