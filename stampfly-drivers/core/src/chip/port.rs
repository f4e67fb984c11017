//! Register access over I2C or SPI, with a time limit on every transfer.

use super::{ChipError, TransferLimit};
use crate::Timebase;
use crate::time::{Standstill, sleep_until, within};
use core::fmt::Debug;
use core::pin::pin;
use embedded_hal_async::i2c::{self, I2c};
use embedded_hal_async::spi::{self, SpiDevice};
use stampfly_types::{Duration, Instant};

/// Registers whose address increments during a transfer. `A` is the type of an address: one byte or
/// two.
pub trait Registers<A = u8> {
    /// The bus's error.
    type Error: Debug;
    /// Default time limit of a transfer.
    const LIMIT: TransferLimit;
    /// Most bytes per write, an even number. The driver splits longer data.
    const LONGEST_WRITE: usize;

    /// Reads consecutive registers, starting at `register`.
    ///
    /// # Errors
    /// When the bus reports an error.
    async fn read(&mut self, register: A, into: &mut [u8]) -> Result<(), Self::Error>;

    /// Writes consecutive registers, starting at `register`.
    ///
    /// # Errors
    /// When the bus reports an error.
    async fn write(&mut self, register: A, data: &[u8]) -> Result<(), Self::Error>;
}

/// Register access that can be taken apart again.
pub trait Wires {
    /// The bus or the SPI device.
    type Bus;

    /// Returns the bus or the SPI device.
    fn release(self) -> Self::Bus;
}

/// Most bytes of data in an I2C write: the limit of Linux's SMBus calls and of the buffers of small
/// controllers.
const I2C_WRITE: usize = 32;
/// Length of such a write, with a register address of two bytes.
const MESSAGE: usize = I2C_WRITE + 2;

/// Registers of a chip on I2C. A register address of two bytes is sent high byte first.
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
        // Register and data in one message. By embedded-hal's contract two writes in one
        // transaction are one message, too, but Linux sends a start between them. That start ends
        // the first write, and the chip takes the data for a register address
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

/// Registers of a chip on SPI with the framing of Bosch's sensors: bit 7 of the first byte is set
/// for a read, bits 0 to 6 are the register address.
///
/// `DUMMY` is the number of bytes between the address of a read and its data: one on an inertial
/// sensor (BMI270 data sheet §6, "SPI interface"), zero on a barometer or a magnetometer (BMP280
/// data sheet §5.3, BMM150 data sheet, "SPI interface"). Other values do not compile.
#[derive(Debug)]
pub struct SpiRegisters<S, const DUMMY: usize = 1>(pub S);

impl<S: SpiDevice, const DUMMY: usize> Registers for SpiRegisters<S, DUMMY> {
    type Error = S::Error;
    const LIMIT: TransferLimit = TransferLimit::SPI;
    /// Fits the DMA buffers of small microcontrollers.
    const LONGEST_WRITE: usize = 256;

    async fn read(&mut self, register: u8, into: &mut [u8]) -> Result<(), S::Error> {
        const { assert!(DUMMY < 2, "no chip has more than one") };
        // The chip returns its dummy byte while the host sends this second byte.
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

/// Register access together with a clock: the basis of a chip driver. Every transfer ends in
/// bounded time.
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
    /// Combines register access with the clock that bounds its transfers and their time limit.
    pub const fn new(registers: R, clock: T, limit: TransferLimit) -> Self {
        Self { registers, clock, limit, standstill: Standstill::new() }
    }

    /// Replaces the time limit for all following transfers.
    pub const fn limit_transfers(&mut self, limit: TransferLimit) {
        self.limit = limit;
    }

    /// Returns the bus, or the SPI device, and the clock.
    pub fn release(self) -> (R::Bus, T)
    where
        R: Wires,
    {
        (self.registers.release(), self.clock)
    }
}

impl<R, T: Timebase> Port<R, T> {
    /// Reads `N` bytes, starting at a register.
    ///
    /// # Errors
    /// [`ChipError::Bus`] when the bus reports an error, [`ChipError::BusTimeout`] when the
    /// transfer takes longer than the limit, [`ChipError::ClockStopped`] when the clock has not
    /// advanced during the preceding waits. The last one ends every polling loop that reads.
    pub async fn read<A, const N: usize>(&mut self, register: A) -> Result<[u8; N], ChipError<R::Error>>
    where
        R: Registers<A>,
    {
        self.check_clock()?;
        let mut bytes = [0; N];
        bounded(&mut self.clock, self.limit.of(N), pin!(self.registers.read(register, &mut bytes))).await?;
        Ok(bytes)
    }

    /// Reads values that stay in use until the next start, such as calibration, twice, and
    /// compares.
    ///
    /// # Errors
    /// [`ChipError::Data`] when the two reads differ, and those of [`read`](Self::read).
    pub async fn read_twice<A: Copy, const N: usize>(&mut self, register: A) -> Result<[u8; N], ChipError<R::Error>>
    where
        R: Registers<A>,
    {
        let first = self.read(register).await?;
        if self.read(register).await? == first { Ok(first) } else { Err(ChipError::Data) }
    }

    /// Writes at most [`Registers::LONGEST_WRITE`] bytes, starting at a register.
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

    /// Checks the clock in a loop that waits repeatedly without a transfer in between.
    ///
    /// # Errors
    /// [`ChipError::ClockStopped`] when the clock has not advanced during waits of 100 ms in total.
    pub fn check_clock<E>(&mut self) -> Result<(), ChipError<E>> {
        if self.standstill.take() { Err(ChipError::ClockStopped) } else { Ok(()) }
    }

    /// Time since power-on.
    pub fn now(&self) -> Instant {
        self.clock.now()
    }

    /// Waits for `span` without a transfer.
    pub async fn wait(&mut self, span: Duration) {
        let instant = self.clock.now() + span;
        self.wait_until(instant).await;
    }

    /// Runs a future until `instant`. Drops it and returns `None` when it has not finished by then.
    pub async fn until<F: Future>(&mut self, instant: Instant, future: F) -> Option<F::Output> {
        // Zero when `instant` has passed. The future is polled once in that case, too.
        let left = instant.since(self.now());
        within(&mut self.clock, left, pin!(future)).await
    }

    /// Waits until `instant` without a transfer; returns at once when `instant` has passed.
    pub async fn wait_until(&mut self, instant: Instant) {
        let left = instant.since(self.clock.now());
        if left > Duration::ZERO {
            sleep_until(&mut self.clock, instant).await;
            // Only waits count: a transfer may take less than one tick of the clock.
            self.standstill.note(left, self.clock.now());
        }
    }
}

impl<I, T> Port<I2cRegisters<I>, T> {
    /// Uses another address for all following transfers, for chips whose address can be changed.
    pub const fn move_to(&mut self, address: u8) {
        self.registers.address = address;
    }
}

/// Runs a transfer and gives it up after `limit`. For drivers of chips that do not fit
/// [`Registers`].
///
/// Pass the transfer pinned where memory is scarce: an `async fn` stores an argument passed by
/// value twice, as the argument and as the local it is moved to, so each such layer doubles its
/// size.
///
/// # Errors
/// [`ChipError::BusTimeout`] after `limit`, [`ChipError::Bus`] when the transfer itself fails.
pub async fn bounded<T: Timebase, V, E>(
    clock: &mut T,
    limit: Duration,
    transfer: impl Future<Output = Result<V, E>>,
) -> Result<V, ChipError<E>> {
    within(clock, limit, transfer).await.ok_or(ChipError::BusTimeout)?.map_err(ChipError::Bus)
}

/// Defines `with_transfer_limit` for a driver whose [`Port`](crate::chip::Port) is in its field
/// `port`.
#[macro_export]
macro_rules! transfer_limit {
    () => {
        /// Gives up a transfer after this time instead of [`TransferLimit::I2C`] or
        /// [`TransferLimit::SPI`].
        #[must_use]
        pub fn with_transfer_limit(mut self, limit: $crate::chip::TransferLimit) -> Self {
            self.port.limit_transfers(limit);
            self
        }
    };
}

/// Defines `release` for a driver that owns only a [`Port`](crate::chip::Port), in its field
/// `port`.
#[macro_export]
macro_rules! release {
    () => {
        /// Takes the driver apart and returns the bus and the clock. The chip continues to measure.
        pub fn release(self) -> (R::Bus, T)
        where
            R: $crate::chip::Wires,
        {
            self.port.release()
        }
    };
}
