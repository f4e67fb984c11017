//! A clock that jumps instead of waiting, and buses whose chip is a closure. For tests of drivers.

use core::cell::Cell;
use core::convert::Infallible;
use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::{i2c, spi};
use stampfly_driver_core::Timebase;
use stampfly_driver_core::chip::{Axis, AxisMap};
use stampfly_types::Instant;
use std::rc::Rc;

/// Mounting of the chips, with every axis different from the body's: body = (z, −x, −y) of the
/// chip.
pub const AXES: AxisMap = AxisMap::new(Axis::PlusZ, Axis::MinusX, Axis::MinusY).expect("a rotation");

/// Virtual time in nanoseconds. A wait advances it at once. While the clock is stopped, waits never
/// end.
#[derive(Clone, Debug)]
pub struct Clock(Rc<Cell<u64>>, Rc<Cell<bool>>);

impl Default for Clock {
    /// Starts one second after power-on.
    fn default() -> Self {
        Self(Rc::new(Cell::new(1_000_000_000)), Rc::new(Cell::new(false)))
    }
}

impl Clock {
    /// Stops the clock, so that waits never end, or starts it again.
    pub fn stop(&self, stopped: bool) {
        self.1.set(stopped);
    }

    /// Advances the time.
    pub fn advance(&self, micros: u64) {
        self.0.set(self.0.get() + micros * 1_000);
    }
}

impl DelayNs for Clock {
    async fn delay_ns(&mut self, ns: u32) {
        if self.1.get() {
            std::future::pending::<Infallible>().await;
        }
        self.0.set(self.0.get() + u64::from(ns));
    }
}

impl Timebase for Clock {
    fn now(&self) -> Instant {
        Instant::from_micros(self.0.get() / 1_000)
    }
}

/// An access of the driver.
pub enum Access<'a> {
    /// A read, starting at a register.
    Read(u8, &'a mut [u8]),
    /// A write, starting at a register.
    Write(u8, &'a [u8]),
}

/// A fault of the chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The chip does not acknowledge.
    Nack,
    /// The transfer never ends.
    Hang,
}

impl i2c::Error for Fault {
    fn kind(&self) -> i2c::ErrorKind {
        i2c::ErrorKind::NoAcknowledge(i2c::NoAcknowledgeSource::Unknown)
    }
}

impl spi::Error for Fault {
    fn kind(&self) -> spi::ErrorKind {
        spi::ErrorKind::Other
    }
}

/// A chip as a boxed closure.
pub type AnyChip = Box<dyn FnMut(Access<'_>) -> Result<(), Fault>>;

/// Duration of a transfer, µs.
pub const TRANSFER: u64 = 20;

/// An I2C bus with one chip.
pub struct I2cBus<F> {
    /// Address of the chip.
    pub address: u8,
    /// Advances with every transfer.
    pub clock: Clock,
    /// Behaviour of the chip.
    pub chip: F,
}

impl<F> i2c::ErrorType for I2cBus<F> {
    type Error = Fault;
}

impl<F: FnMut(Access<'_>) -> Result<(), Fault>> i2c::I2c for I2cBus<F> {
    async fn transaction(&mut self, address: u8, operations: &mut [i2c::Operation<'_>]) -> Result<(), Fault> {
        assert_eq!(address, self.address);
        let outcome = match operations {
            [i2c::Operation::Write([register]), i2c::Operation::Read(into)] => {
                (self.chip)(Access::Read(*register, into))
            }
            [i2c::Operation::Write([register, data @ ..])] => (self.chip)(Access::Write(*register, data)),
            other => panic!("not a register access: {other:?}"),
        };
        finish(&self.clock, outcome).await
    }
}

/// An SPI device of Bosch's, with a dummy byte before the data of a read, as inertial sensors have
/// it, or without one.
pub struct SpiBus<F> {
    /// Advances with every transfer.
    pub clock: Clock,
    /// Behaviour of the chip.
    pub chip: F,
}

impl<F> spi::ErrorType for SpiBus<F> {
    type Error = Fault;
}

impl<F: FnMut(Access<'_>) -> Result<(), Fault>> spi::SpiDevice for SpiBus<F> {
    async fn transaction(&mut self, operations: &mut [spi::Operation<'_, u8>]) -> Result<(), Fault> {
        let outcome = match operations {
            // The address with the read bit, an optional dummy byte, the data.
            [spi::Operation::Write([register, 0] | [register]), spi::Operation::Read(into)] if register & 0x80 != 0 => {
                (self.chip)(Access::Read(register & 0x7F, into))
            }
            [spi::Operation::Write([register]), spi::Operation::Write(data)] if register & 0x80 == 0 => {
                (self.chip)(Access::Write(*register, data))
            }
            other => panic!("not a register access: {other:?}"),
        };
        finish(&self.clock, outcome).await
    }
}

/// Ends a transfer: after its duration, or never.
pub async fn finish(clock: &Clock, outcome: Result<(), Fault>) -> Result<(), Fault> {
    if outcome == Err(Fault::Hang) {
        std::future::pending::<Infallible>().await;
    }
    clock.advance(TRANSFER);
    outcome
}

/// Polls a call once, asserts that it is still pending, and drops it.
pub fn cancel(call: impl Future) {
    let mut call = std::pin::pin!(call);
    let mut context = std::task::Context::from_waker(std::task::Waker::noop());
    assert!(call.as_mut().poll(&mut context).is_pending());
}
