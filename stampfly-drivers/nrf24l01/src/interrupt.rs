//! The chip's interrupt pin, if there is one and as long as it can be trusted.
//!
//! It is active low (8.5). A pin that is silent, stuck or wired elsewhere is wrong a few times and ignored from then on: the driver asks the chip
//! instead.

use core::convert::Infallible;
use embedded_hal::digital::ErrorType;
use embedded_hal_async::digital::Wait;
use stampfly_driver_core::Timebase;
use stampfly_driver_core::chip::Port;
use stampfly_types::{Duration, Instant};

/// How often in a row the pin may be wrong.
const PATIENCE: u8 = 4;

/// What the last wait was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Said {
    /// There was none, or nobody asked the pin.
    Nothing,
    Low,
    High,
}

/// A pin, and how often in a row it was wrong.
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

    /// Forgets what the pin did wrong.
    pub(super) const fn trust(&mut self) {
        (self.wrong, self.said) = (0, Said::Nothing);
    }

    /// Waits for the pin until then, or for the next poll when there is none.
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

    /// Compares what the pin said with what the chip has. A pin that is low all the time is asked every other time only.
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

/// No interrupt pin.
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
