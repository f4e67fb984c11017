//! Runs the asynchronous drivers in a program without `async`.
//!
//! Each driver is written once, asynchronously. On a blocking bus a transfer has finished when its
//! future is polled for the first time, so polling the driver's future to its end is an ordinary
//! function call. [`Blocking`] turns a blocking bus or delay into an asynchronous one,
//! [`BlockingClock`] makes a [`Timebase`], and [`block_on`] makes the call.
//!
//! Not for a program with an executor: nothing else runs while a blocking bus transfers. A driver
//! cannot give up a blocking transfer that hangs; the bus needs a time-out of its own.

use crate::Timebase;
use core::future::Future;
use core::pin::pin;
use core::task::{Context, Poll, Waker};
use embedded_hal::{delay, i2c, spi};
use embedded_hal_async as asynchronous;
use stampfly_types::Instant;

/// Runs a future to its end on this thread, and spins while it is pending.
///
/// ```
/// use stampfly_driver_core::blocking::block_on;
/// assert_eq!(block_on(async { 6 * 7 }), 42);
/// ```
pub fn block_on<T>(future: impl Future<Output = T>) -> T {
    let mut future = pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    loop {
        if let Poll::Ready(value) = future.as_mut().poll(&mut context) {
            return value;
        }
        core::hint::spin_loop();
    }
}

/// Wraps a blocking bus or delay as an asynchronous one. Every operation completes at its first
/// poll.
///
/// ```
/// # use core::convert::Infallible;
/// # use embedded_hal::i2c::{ErrorType, I2c, Operation};
/// # struct Wire;
/// # impl ErrorType for Wire { type Error = Infallible; }
/// # impl I2c for Wire {
/// #     fn transaction(&mut self, _: u8, operations: &mut [Operation<'_>]) -> Result<(), Infallible> {
/// #         for operation in operations { if let Operation::Read(into) = operation { into.fill(0x58) } }
/// #         Ok(())
/// #     }
/// # }
/// use embedded_hal_async::i2c::I2c as _;
/// use stampfly_driver_core::blocking::{Blocking, block_on};
///
/// let mut identification = [0];
/// block_on(Blocking(Wire).write_read(0x76, &[0xD0], &mut identification))?;
/// assert_eq!(identification, [0x58]);
/// # Ok::<(), Infallible>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Blocking<B>(pub B);

impl<B: i2c::ErrorType> i2c::ErrorType for Blocking<B> {
    type Error = B::Error;
}

impl<B: i2c::I2c> asynchronous::i2c::I2c for Blocking<B> {
    async fn transaction(&mut self, address: u8, operations: &mut [i2c::Operation<'_>]) -> Result<(), B::Error> {
        self.0.transaction(address, operations)
    }
}

impl<B: spi::ErrorType> spi::ErrorType for Blocking<B> {
    type Error = B::Error;
}

impl<B: spi::SpiDevice> asynchronous::spi::SpiDevice for Blocking<B> {
    async fn transaction(&mut self, operations: &mut [spi::Operation<'_, u8>]) -> Result<(), B::Error> {
        self.0.transaction(operations)
    }
}

impl<D: delay::DelayNs> asynchronous::delay::DelayNs for Blocking<D> {
    async fn delay_ns(&mut self, ns: u32) {
        self.0.delay_ns(ns);
    }
    async fn delay_us(&mut self, us: u32) {
        self.0.delay_us(us);
    }
    async fn delay_ms(&mut self, ms: u32) {
        self.0.delay_ms(ms);
    }
}

/// A [`Timebase`] made of a blocking delay and a function that returns the time since power-on.
///
/// ```
/// # struct Delay;
/// # impl embedded_hal::delay::DelayNs for Delay { fn delay_ns(&mut self, _: u32) {} }
/// use stampfly_driver_core::{Timebase, blocking::BlockingClock};
/// use stampfly_types::Instant;
/// let clock = BlockingClock::new(Delay, || Instant::from_micros(1_000_000));
/// assert_eq!(clock.now(), Instant::from_secs(1));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct BlockingClock<D, F> {
    delay: Blocking<D>,
    now: F,
}

impl<D, F: Fn() -> Instant> BlockingClock<D, F> {
    /// Combines a delay with a function that returns the time since power-on.
    pub const fn new(delay: D, now: F) -> Self {
        Self { delay: Blocking(delay), now }
    }
}

impl<D: delay::DelayNs, F> asynchronous::delay::DelayNs for BlockingClock<D, F> {
    async fn delay_ns(&mut self, ns: u32) {
        self.delay.delay_ns(ns).await;
    }
    async fn delay_us(&mut self, us: u32) {
        self.delay.delay_us(us).await;
    }
    async fn delay_ms(&mut self, ms: u32) {
        self.delay.delay_ms(ms).await;
    }
}

impl<D: delay::DelayNs, F: Fn() -> Instant> Timebase for BlockingClock<D, F> {
    fn now(&self) -> Instant {
        (self.now)()
    }
}
