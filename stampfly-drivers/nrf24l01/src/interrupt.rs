//! The interrupt pin, which is optional.
//!
//! It is active low (8.5). A pin that stays silent, is stuck or is connected elsewhere is ignored
//! after a few errors, and the driver polls the chip instead.

use core::convert::Infallible;
use embedded_hal::digital::ErrorType;
use embedded_hal_async::digital::Wait;
use stampfly_driver_core::Timebase;
use stampfly_driver_core::chip::Port;
use stampfly_types::{Duration, Instant};

/// Number of consecutive errors after which the pin is ignored.
const PATIENCE: u8 = 4;

/// Result of the last wait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Said {
    /// No wait, or a wait without the pin.
    Nothing,
    Low,
    High,
}

/// The pin, and its number of consecutive errors.
#[derive(Debug)]
pub(super) struct Interrupt<P> {
    pin: Option<P>,
    wrong: u8,
    said: Said,
}

impl Interrupt<NoPin> {
    pub(super) const fn none() -> Self {
        Self { pin: None, wrong: 0, said: Said::Nothing }
    }
}

impl<P> Interrupt<P> {
    pub(super) fn release(self) -> Option<P> {
        self.pin
    }
}

impl<P: Wait> Interrupt<P> {
    pub(super) const fn on(pin: P) -> Self {
        Self { pin: Some(pin), wrong: 0, said: Said::Nothing }
    }

    /// Resets the error count.
    pub(super) const fn trust(&mut self) {
        (self.wrong, self.said) = (0, Said::Nothing);
    }

    /// Waits for the pin until an instant. Without a usable pin, waits for one poll period.
    pub(super) async fn wait<R, T: Timebase>(&mut self, port: &mut Port<R, T>, until: Instant, poll: Duration) {
        match &mut self.pin {
            Some(pin) if self.wrong < PATIENCE && self.said != Said::Low => {
                let low = matches!(port.until(until, pin.wait_for_low()).await, Some(Ok(())));
                self.said = if low { Said::Low } else { Said::High };
            }
            _ => {
                self.said = Said::Nothing;
                port.wait(poll.min(until.since(port.now()))).await;
            }
        }
    }

    /// Compares the pin with the chip, and counts errors. After a wait that ended low the next wait
    /// polls, so a pin that is stuck low is used only every other time.
    pub(super) const fn judge(&mut self, packet: bool) {
        match (self.said, packet) {
            (Said::Nothing, _) | (Said::High, false) => return,
            (Said::Low, true) => self.wrong = 0,
            (Said::Low, false) | (Said::High, true) => self.wrong = self.wrong.saturating_add(1),
        }
        if packet {
            self.said = Said::Nothing;
        }
    }
}

/// Type of the interrupt pin when none is connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoPin {}

impl ErrorType for NoPin {
    type Error = Infallible;
}

impl Wait for NoPin {
    async fn wait_for_high(&mut self) -> Result<(), Infallible> {
        match *self {}
    }
    async fn wait_for_low(&mut self) -> Result<(), Infallible> {
        match *self {}
    }
    async fn wait_for_rising_edge(&mut self) -> Result<(), Infallible> {
        match *self {}
    }
    async fn wait_for_falling_edge(&mut self) -> Result<(), Infallible> {
        match *self {}
    }
    async fn wait_for_any_edge(&mut self) -> Result<(), Infallible> {
        match *self {}
    }
}
