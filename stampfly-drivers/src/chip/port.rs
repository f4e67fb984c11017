//! A chip as registers of bytes, whichever wires it hangs on.

use super::ChipError;
use crate::Timebase;
use crate::time::{sleep_until, within};
use core::fmt::Debug;
use embedded_hal_async::i2c::{self, I2c};
use embedded_hal_async::spi::{self, SpiDevice};
use stampfly_types::Micros;

/// The longest a transfer may take, waiting for other devices of the bus included: three times the longest of the
/// StampFly (a range read-out, 134 bytes at 400 kHz).
const BUS_LIMIT: Micros = Micros::from_millis(10);

/// Registers with addresses of one byte that count up by themselves.
pub trait Registers {
    /// The bus's error.
    type Error: Debug;

    /// Reads registers from `register` on.
    ///
    /// # Errors
    /// When the bus refuses.
    async fn read(&mut self, register: u8, into: &mut [u8]) -> Result<(), Self::Error>;

    /// Writes registers from `register` on.
    ///
    /// # Errors
    /// When the bus refuses.
    async fn write(&mut self, register: u8, data: &[u8]) -> Result<(), Self::Error>;
}

/// Registers behind an I2C address.
#[derive(Debug)]
pub struct I2cRegisters<I> {
    bus: I,
    address: u8,
}

impl<I: I2c> I2cRegisters<I> {
    /// The chip with this 7-bit address.
    pub const fn new(bus: I, address: u8) -> Self {
        Self { bus, address }
    }
}

impl<I: I2c> Registers for I2cRegisters<I> {
    type Error = I::Error;

    async fn read(&mut self, register: u8, into: &mut [u8]) -> Result<(), I::Error> {
        self.bus.write_read(self.address, &[register], into).await
    }

    async fn write(&mut self, register: u8, data: &[u8]) -> Result<(), I::Error> {
        // Two writes in one transaction go out without a second start: no buffer needed to join them.
        let mut operations = [i2c::Operation::Write(&[register]), i2c::Operation::Write(data)];
        self.bus.transaction(self.address, &mut operations).await
    }
}

/// Registers behind an SPI chip select, as Bosch's inertial sensors do it: bit 7 of the address says read, and one
/// dummy byte comes before the data (BMI270 data sheet §6, "SPI interface").
#[derive(Debug)]
pub struct SpiRegisters<S>(pub S);

impl<S: SpiDevice> Registers for SpiRegisters<S> {
    type Error = S::Error;

    async fn read(&mut self, register: u8, into: &mut [u8]) -> Result<(), S::Error> {
        // The dummy byte is clocked in while a second byte is clocked out.
        self.0.transaction(&mut [spi::Operation::Write(&[register | 0x80, 0]), spi::Operation::Read(into)]).await
    }

    async fn write(&mut self, register: u8, data: &[u8]) -> Result<(), S::Error> {
        self.0.transaction(&mut [spi::Operation::Write(&[register & 0x7F]), spi::Operation::Write(data)]).await
    }
}

/// Registers and a clock: what a driver works with. Every transfer ends in bounded time.
#[derive(Debug)]
pub(crate) struct Port<R, T> {
    registers: R,
    clock: T,
}

impl<R: Registers, T: Timebase> Port<R, T> {
    pub(crate) const fn new(registers: R, clock: T) -> Self {
        Self { registers, clock }
    }

    pub(crate) async fn read<const N: usize>(&mut self, register: u8) -> Result<[u8; N], ChipError<R::Error>> {
        let mut bytes = [0; N];
        bounded(&self.clock, self.registers.read(register, &mut bytes)).await?;
        Ok(bytes)
    }

    pub(crate) async fn write(&mut self, register: u8, data: &[u8]) -> Result<(), ChipError<R::Error>> {
        bounded(&self.clock, self.registers.write(register, data)).await
    }

    pub(crate) fn now(&self) -> Micros {
        self.clock.now()
    }

    pub(crate) async fn wait(&mut self, span: Micros) {
        let instant = self.clock.now() + span;
        self.wait_until(instant).await;
    }

    pub(crate) async fn wait_until(&mut self, instant: Micros) {
        sleep_until(&mut self.clock, instant).await;
    }
}

/// A transfer, given up after [`BUS_LIMIT`].
pub(crate) async fn bounded<T: Timebase, V, E>(
    clock: &T,
    transfer: impl Future<Output = Result<V, E>>,
) -> Result<V, ChipError<E>> {
    within(clock, BUS_LIMIT, transfer).await.ok_or(ChipError::BusTimeout)?.map_err(ChipError::Bus)
}
