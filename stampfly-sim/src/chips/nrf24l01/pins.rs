//! Pins of an nRF24L01 outside its SPI: CE and the interrupt.

use super::air::Air;
use core::convert::Infallible;
use core::future::{Future, poll_fn};
use core::pin::Pin;
use core::task::Poll;
use embedded_hal::digital::{ErrorType, InputPin, OutputPin};
use embedded_hal_async::digital::Wait;

/// CE: the radio listens or sends while it is high. From
/// [`SpiPort::chip_enable`](crate::chips::SpiPort::chip_enable).
#[derive(Clone, Debug)]
pub struct ChipEnable {
    pub(super) air: Air,
    pub(super) number: usize,
}

impl ErrorType for ChipEnable {
    type Error = Infallible;
}

impl ChipEnable {
    fn set(&self, high: bool) {
        let now = self.air.clock().now();
        self.air.with(self.number, now, |radio| radio.enable(high, now));
    }
}

impl OutputPin for ChipEnable {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.set(false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.set(true);
        Ok(())
    }
}

/// The interrupt, active low. From
/// [`SpiPort::radio_interrupt`](crate::chips::SpiPort::radio_interrupt).
///
/// Waiting for levels is exact; an edge is detected as a change between two polls.
#[derive(Clone, Debug)]
pub struct RadioInterrupt {
    pub(super) air: Air,
    pub(super) number: usize,
}

impl RadioInterrupt {
    fn is_asserted(&self) -> bool {
        self.air.interrupts(self.number, None).0
    }

    async fn until(&self, asserted: bool) {
        let clock = self.air.clock();
        poll_fn(|context| {
            let (now, next) = self.air.interrupts(self.number, Some(context.waker()));
            if now == asserted {
                return Poll::Ready(());
            }
            if let Some(next) = next {
                // Polling once registers the deadline with the clock.
                let _ = Pin::new(&mut clock.sleep_until(next)).poll(context);
            }
            Poll::Pending
        })
        .await;
    }
}

impl ErrorType for RadioInterrupt {
    type Error = Infallible;
}

impl InputPin for RadioInterrupt {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(!self.is_asserted())
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(self.is_asserted())
    }
}

impl Wait for RadioInterrupt {
    async fn wait_for_high(&mut self) -> Result<(), Infallible> {
        self.until(false).await;
        Ok(())
    }

    async fn wait_for_low(&mut self) -> Result<(), Infallible> {
        self.until(true).await;
        Ok(())
    }

    async fn wait_for_rising_edge(&mut self) -> Result<(), Infallible> {
        self.until(true).await;
        self.wait_for_high().await
    }

    async fn wait_for_falling_edge(&mut self) -> Result<(), Infallible> {
        self.until(false).await;
        self.wait_for_low().await
    }

    async fn wait_for_any_edge(&mut self) -> Result<(), Infallible> {
        let before = self.is_asserted();
        self.until(!before).await;
        Ok(())
    }
}
