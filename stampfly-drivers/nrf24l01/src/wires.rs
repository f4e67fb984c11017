//! Commands on SPI: a command byte and its data.

use crate::codec::command;
use embedded_hal_async::spi::{Operation, SpiDevice};
use stampfly_driver_core::chip::{Registers, TransferLimit, Wires};

/// The chip's commands as registers: addresses below 0x20 are registers, all others are other
/// commands.
#[derive(Debug)]
pub(crate) struct Commands<S>(pub S);

impl<S: SpiDevice> Registers for Commands<S> {
    type Error = S::Error;
    const LIMIT: TransferLimit = TransferLimit::SPI;
    /// Length of the longest payload.
    const LONGEST_WRITE: usize = 32;

    async fn read(&mut self, command: u8, into: &mut [u8]) -> Result<(), S::Error> {
        self.0.transaction(&mut [Operation::Write(&[command]), Operation::Read(into)]).await
    }

    async fn write(&mut self, command: u8, data: &[u8]) -> Result<(), S::Error> {
        // All commands that write have this bit set.
        self.0.transaction(&mut [Operation::Write(&[command | command::WRITE]), Operation::Write(data)]).await
    }
}

impl<S> Wires for Commands<S> {
    type Bus = S;

    fn release(self) -> S {
        self.0
    }
}
