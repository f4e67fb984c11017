//! A bus that changes what a chip answers, or takes its time.

use embedded_hal_async::i2c::{self, I2c};
use embedded_hal_async::spi::{self, SpiDevice};
use stampfly_sim::chips::BusError;
use stampfly_sim::time::Clock;
use stampfly_types::Micros;

/// What is wrong with the bus.
#[derive(Clone, Copy)]
pub struct Spoil {
    /// How much longer every transfer takes.
    pub delay: Micros,
    /// What becomes of the answer of a register.
    pub change: fn(register: u16, answer: &mut [u8]),
}

impl Spoil {
    /// Nothing.
    pub const NOT: Self = Self { delay: Micros::ZERO, change: |_, _| () };

    /// Answers are changed.
    pub const fn changed(change: fn(u16, &mut [u8])) -> Self {
        Self { change, ..Self::NOT }
    }

    /// Every transfer takes so much longer.
    pub const fn slow(delay: Micros) -> Self {
        Self { delay, ..Self::NOT }
    }
}

/// A bus with that.
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
        (self.spoil.change)(register.iter().fold(0, |register, byte| register << 8 | u16::from(*byte)), answer);
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
