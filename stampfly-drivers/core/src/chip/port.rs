//! A chip as registers of bytes, whichever wires it hangs on.

use super::{ChipError, TransferLimit};
use crate::Timebase;
use crate::time::{Standstill, sleep_until, within};
use core::fmt::Debug;
use core::pin::pin;
use embedded_hal_async::i2c::{self, I2c};
use embedded_hal_async::spi::{self, SpiDevice};
use stampfly_types::{Duration, Instant};

/// Registers that count up by themselves; `A` is their address, of one byte or of two.
pub trait Registers<A = u8> {
    /// The bus's error.
    type Error: Debug;
    /// How long a transfer on these wires may take, unless the driver is told otherwise.
    const LIMIT: TransferLimit;
    /// So many bytes may be written at once; even. What is longer is for the driver to divide.
    const LONGEST_WRITE: usize;

    /// Reads registers from `register` on.
    ///
    /// # Errors
    /// When the bus refuses.
    async fn read(&mut self, register: A, into: &mut [u8]) -> Result<(), Self::Error>;

    /// Writes registers from `register` on.
    ///
    /// # Errors
    /// When the bus refuses.
    async fn write(&mut self, register: A, data: &[u8]) -> Result<(), Self::Error>;
}

/// Registers that give back the wires they were made of.
pub trait Wires {
    /// The bus or device.
    type Bus;

    /// Gives it back.
    fn release(self) -> Self::Bus;
}

/// Bytes of data in an I2C write: as many as Linux's SMBus calls and the buffers of small controllers hold.
const I2C_WRITE: usize = 32;
/// The same with a register of two bytes.
const MESSAGE: usize = I2C_WRITE + 2;

/// Registers behind an I2C address; addresses of two bytes go out high byte first.
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

    async fn read_after(&mut self, register: &[u8], into: &mut [u8]) -> Result<(), I::Error> {
        self.bus.write_read(self.address, register, into).await
    }

    async fn write_after(&mut self, register: &[u8], data: &[u8]) -> Result<(), I::Error> {
        // Register and data in one piece. Two writes in one transaction have to do as well, says embedded-hal; but Linux makes a message
        // of each, and the start between them ends the first: the chip takes the data for an address
        // (rust-embedded/linux-embedded-hal#82).
        let mut message = [0; MESSAGE];
        let Some(joined) = message.get_mut(..register.len() + data.len()) else {
            let mut operations = [i2c::Operation::Write(register), i2c::Operation::Write(data)];
            return self.bus.transaction(self.address, &mut operations).await;
        };
        for (place, byte) in joined.iter_mut().zip(register.iter().chain(data)) {
            *place = *byte;
        }
        self.bus.write(self.address, joined).await
    }
}

impl<I> Wires for I2cRegisters<I> {
    type Bus = I;

    fn release(self) -> I {
        self.bus
    }
}

impl<I: I2c> Registers for I2cRegisters<I> {
    type Error = I::Error;
    const LIMIT: TransferLimit = TransferLimit::I2C;
    const LONGEST_WRITE: usize = I2C_WRITE;

    async fn read(&mut self, register: u8, into: &mut [u8]) -> Result<(), I::Error> {
        self.read_after(&[register], into).await
    }

    async fn write(&mut self, register: u8, data: &[u8]) -> Result<(), I::Error> {
        self.write_after(&[register], data).await
    }
}

impl<I: I2c> Registers<u16> for I2cRegisters<I> {
    type Error = I::Error;
    const LIMIT: TransferLimit = TransferLimit::I2C;
    const LONGEST_WRITE: usize = I2C_WRITE;

    async fn read(&mut self, register: u16, into: &mut [u8]) -> Result<(), I::Error> {
        self.read_after(&register.to_be_bytes(), into).await
    }

    async fn write(&mut self, register: u16, data: &[u8]) -> Result<(), I::Error> {
        self.write_after(&register.to_be_bytes(), data).await
    }
}

/// Registers behind an SPI chip select, as Bosch's sensors do it: bit 7 of the address says read, and the other seven are the register's.
///
/// `DUMMY` bytes pass between the address of a read and its data: one with an inertial sensor (BMI270 data sheet §6, "SPI interface"), none
/// with a barometer or a magnetometer (BMP280 data sheet §5.3, BMM150 data sheet, "SPI interface"). Other numbers do not compile.
#[derive(Debug)]
pub struct SpiRegisters<S, const DUMMY: usize = 1>(pub S);

impl<S: SpiDevice, const DUMMY: usize> Registers for SpiRegisters<S, DUMMY> {
    type Error = S::Error;
    const LIMIT: TransferLimit = TransferLimit::SPI;
    /// Small enough for the DMA buffers of small parts.
    const LONGEST_WRITE: usize = 256;

    async fn read(&mut self, register: u8, into: &mut [u8]) -> Result<(), S::Error> {
        const { assert!(DUMMY < 2, "no chip has more than one") };
        // A dummy byte is clocked in while a second byte is clocked out.
        let command: &[u8] = if DUMMY == 0 { &[register | 0x80] } else { &[register | 0x80, 0] };
        self.0.transaction(&mut [spi::Operation::Write(command), spi::Operation::Read(into)]).await
    }

    async fn write(&mut self, register: u8, data: &[u8]) -> Result<(), S::Error> {
        self.0.transaction(&mut [spi::Operation::Write(&[register & 0x7F]), spi::Operation::Write(data)]).await
    }
}

impl<S, const DUMMY: usize> Wires for SpiRegisters<S, DUMMY> {
    type Bus = S;

    fn release(self) -> S {
        self.0
    }
}

/// Registers and a clock: what a driver works with. Every transfer ends in bounded time.
///
/// ```
/// use embedded_hal_async::i2c::I2c;
/// use stampfly_driver_core::Timebase;
/// use stampfly_driver_core::chip::{ChipError, I2cRegisters, Port, TransferLimit};
/// use stampfly_types::Duration;
///
/// /// The temperature of a TMP102, in sixteenths of a degree, after one conversion of its own.
/// async fn temperature<I: I2c>(bus: I, clock: impl Timebase) -> Result<i16, ChipError<I::Error>> {
///     let mut port = Port::new(I2cRegisters::new(bus, 0x48), clock, TransferLimit::I2C);
///     port.write(1u8, &[0xE1, 0xA0]).await?;
///     port.wait(Duration::from_millis(35)).await;
///     Ok(i16::from_be_bytes(port.read(0u8).await?) >> 4)
/// }
/// ```
#[derive(Debug)]
pub struct Port<R, T> {
    registers: R,
    clock: T,
    limit: TransferLimit,
    standstill: Standstill,
}

impl<R, T> Port<R, T> {
    /// Registers, the clock that bounds their transfers, and how long one may take.
    pub const fn new(registers: R, clock: T, limit: TransferLimit) -> Self {
        Self { registers, clock, limit, standstill: Standstill::new() }
    }

    /// Gives a transfer up after another time from now on.
    pub const fn limit_transfers(&mut self, limit: TransferLimit) {
        self.limit = limit;
    }

    /// Gives the bus, or the device, and the clock back.
    pub fn release(self) -> (R::Bus, T)
    where
        R: Wires,
    {
        (self.registers.release(), self.clock)
    }
}

impl<R, T: Timebase> Port<R, T> {
    /// Reads `N` bytes from a register on.
    ///
    /// # Errors
    /// [`ChipError::Bus`] when the bus refuses, [`ChipError::BusTimeout`] when it takes longer than the limit, [`ChipError::ClockStopped`]
    /// when the clock took no notice of the waits before: so everything that polls ends.
    pub async fn read<A, const N: usize>(&mut self, register: A) -> Result<[u8; N], ChipError<R::Error>>
    where
        R: Registers<A>,
    {
        self.check_clock()?;
        let mut bytes = [0; N];
        bounded(&mut self.clock, self.limit.of(N), pin!(self.registers.read(register, &mut bytes))).await?;
        Ok(bytes)
    }

    /// Reads what will be believed until the next start, such as calibration: twice, and refuses it unless both agree.
    ///
    /// # Errors
    /// [`ChipError::Data`] when they do not, and those of [`read`](Self::read).
    pub async fn read_twice<A: Copy, const N: usize>(&mut self, register: A) -> Result<[u8; N], ChipError<R::Error>>
    where
        R: Registers<A>,
    {
        let first = self.read(register).await?;
        if self.read(register).await? == first { Ok(first) } else { Err(ChipError::Data) }
    }

    /// Writes from a register on, no more than [`Registers::LONGEST_WRITE`] at once.
    ///
    /// # Errors
    /// Those of [`read`](Self::read).
    pub async fn write<A>(&mut self, register: A, data: &[u8]) -> Result<(), ChipError<R::Error>>
    where
        R: Registers<A>,
    {
        self.check_clock()?;
        bounded(&mut self.clock, self.limit.of(data.len()), pin!(self.registers.write(register, data))).await
    }

    /// For whoever waits again and again without a transfer in between.
    ///
    /// # Errors
    /// [`ChipError::ClockStopped`] when the clock took no notice of waits of 100 ms in all.
    pub fn check_clock<E>(&mut self) -> Result<(), ChipError<E>> {
        if self.standstill.take() { Err(ChipError::ClockStopped) } else { Ok(()) }
    }

    /// Time since power-on.
    pub fn now(&self) -> Instant {
        self.clock.now()
    }

    /// Leaves the chip alone for so long.
    pub async fn wait(&mut self, span: Duration) {
        let instant = self.clock.now() + span;
        self.wait_until(instant).await;
    }

    /// The outcome of a future, or `None` when it is not there at `instant`; it is dropped then.
    pub async fn until<F: Future>(&mut self, instant: Instant, future: F) -> Option<F::Output> {
        let left = instant.since(self.now());
        within(&mut self.clock, left, pin!(future)).await
    }

    /// Leaves the chip alone until then; returns at once when that has passed.
    pub async fn wait_until(&mut self, instant: Instant) {
        let left = instant.since(self.clock.now());
        if left > Duration::ZERO {
            sleep_until(&mut self.clock, instant).await;
            self.standstill.note(left, self.clock.now());
        }
    }
}

impl<I, T> Port<I2cRegisters<I>, T> {
    /// Talks to another address from now on, for chips that move.
    pub const fn move_to(&mut self, address: u8) {
        self.registers.address = address;
    }
}

/// A transfer, given up after `limit`: for a driver whose chip has no registers that fit [`Registers`].
///
/// Hand it over pinned where memory is scarce: an `async fn` keeps room for what it is given beside what it makes of it, so each layer
/// that passes a transfer on by value doubles its size.
///
/// # Errors
/// [`ChipError::BusTimeout`] then, and [`ChipError::Bus`] when the transfer itself fails.
pub async fn bounded<T: Timebase, V, E>(
    clock: &mut T,
    limit: Duration,
    transfer: impl Future<Output = Result<V, E>>,
) -> Result<V, ChipError<E>> {
    within(clock, limit, transfer).await.ok_or(ChipError::BusTimeout)?.map_err(ChipError::Bus)
}

/// The method of every driver on a port that changes how long a transfer may take; its port is in a field `port`.
#[macro_export]
macro_rules! transfer_limit {
    () => {
        /// Gives up a transfer after this time instead of [`TransferLimit::I2C`] or [`TransferLimit::SPI`].
        #[must_use]
        pub fn with_transfer_limit(mut self, limit: $crate::chip::TransferLimit) -> Self {
            self.port.limit_transfers(limit);
            self
        }
    };
}

/// The method of a driver on nothing but a port, in a field `port`, that gives bus and clock back.
#[macro_export]
macro_rules! release {
    () => {
        /// Takes the driver apart: the bus and the clock. The chip goes on measuring.
        pub fn release(self) -> (R::Bus, T)
        where
            R: $crate::chip::Wires,
        {
            self.port.release()
        }
    };
}
