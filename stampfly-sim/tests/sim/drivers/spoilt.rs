//! A bus that changes a chip's answers or adds latency.

use embedded_hal_async::i2c::{self, I2c};
use embedded_hal_async::spi::{self, SpiDevice};
use stampfly_sim::chips::BusError;
use stampfly_sim::time::Clock;
use stampfly_types::Duration;

/// Transformation of a register's answer.
pub type Change = Box<dyn Fn(u16, &mut [u8])>;

/// Fault of the bus.
pub struct Spoil {
    /// Additional duration of every transfer.
    pub delay: Duration,
    pub change: Option<Change>,
}

impl Spoil {
    /// No fault.
    pub const NOT: Self = Self { delay: Duration::ZERO, change: None };

    /// Changed answers.
    pub fn changed(change: Change) -> Self {
        Self { change: Some(change), ..Self::NOT }
    }

    /// Additional duration of every transfer.
    pub const fn slow(delay: Duration) -> Self {
        Self { delay, change: None }
    }
}

/// A bus with this fault.
pub struct Spoilt<B> {
    pub bus: B,
    pub clock: Clock,
    pub spoil: Spoil,
}

impl<B> Spoilt<B> {
    async fn wait(&self) {
        self.clock.sleep_until(self.clock.now() + self.spoil.delay).await;
    }

    fn answer(&self, register: &[u8], answer: &mut [u8]) {
        if let Some(change) = &self.spoil.change {
            change(register.iter().fold(0, |register, byte| register << 8 | u16::from(*byte)), answer);
        }
    }
}

impl<B: I2c<Error = BusError>> i2c::ErrorType for Spoilt<B> {
    type Error = BusError;
}

impl<B: I2c<Error = BusError>> I2c for Spoilt<B> {
    async fn transaction(&mut self, address: u8, operations: &mut [i2c::Operation<'_>]) -> Result<(), BusError> {
        self.wait().await;
        self.bus.transaction(address, operations).await?;
        if let [i2c::Operation::Write(register), i2c::Operation::Read(answer)] = operations {
            self.answer(register, answer);
        }
        Ok(())
    }
}

impl<B: SpiDevice<Error = BusError>> spi::ErrorType for Spoilt<B> {
    type Error = BusError;
}

impl<B: SpiDevice<Error = BusError>> SpiDevice for Spoilt<B> {
    async fn transaction(&mut self, operations: &mut [spi::Operation<'_, u8>]) -> Result<(), BusError> {
        self.wait().await;
        self.bus.transaction(operations).await?;
        if let [spi::Operation::Write(register), .., spi::Operation::Read(answer)] = operations {
            self.answer(register, answer);
        }
        Ok(())
    }
}
