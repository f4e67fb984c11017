//! Register access on SPI with two bus clocks: a fast one for data, a slow one for everything else.

use crate::codec::register;
use embedded_hal_async::spi::{Operation, SpiDevice};
use stampfly_driver_core::chip::{Registers, TransferLimit, Wires};

/// Bus clock for a transfer with this chip (PS 6.5).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum BusClock {
    /// Up to 1 MHz: all registers.
    Setup,
    /// Up to 20 MHz: data and interrupt status, read only.
    Data,
}

/// The device, and the function that changes its clock.
#[derive(Debug)]
pub(crate) struct Clocked<S, F> {
    device: S,
    change: F,
    /// The clock of the last transfer.
    clock: Option<BusClock>,
}

impl<S, F> Clocked<S, F> {
    pub(crate) const fn new(device: S, change: F) -> Self {
        Self { device, change, clock: None }
    }
}

impl<S: SpiDevice, F: FnMut(&mut S, BusClock)> Clocked<S, F> {
    fn set(&mut self, clock: BusClock) {
        if self.clock != Some(clock) {
            (self.change)(&mut self.device, clock);
            self.clock = Some(clock);
        }
    }
}

impl<S: SpiDevice, F: FnMut(&mut S, BusClock)> Registers for Clocked<S, F> {
    type Error = S::Error;
    const LIMIT: TransferLimit = TransferLimit::SPI;
    const LONGEST_WRITE: usize = 32;

    async fn read(&mut self, register: u8, into: &mut [u8]) -> Result<(), S::Error> {
        let data = register::INT_STATUS..=register::GYRO_ZOUT_L;
        self.set(if data.contains(&register) { BusClock::Data } else { BusClock::Setup });
        self.device.transaction(&mut [Operation::Write(&[register | 0x80]), Operation::Read(into)]).await
    }

    async fn write(&mut self, register: u8, data: &[u8]) -> Result<(), S::Error> {
        self.set(BusClock::Setup);
        self.device.transaction(&mut [Operation::Write(&[register]), Operation::Write(data)]).await
    }
}

impl<S, F> Wires for Clocked<S, F> {
    type Bus = S;

    fn release(self) -> S {
        self.device
    }
}
