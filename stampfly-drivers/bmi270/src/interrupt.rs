//! The chip's interrupt pin, if there is one and as long as it can be trusted.
//!
//! A pin that is silent, stuck high or wired elsewhere costs a little latency a few times and is ignored from then on:
//! the driver knows without it when samples are due.

use core::convert::Infallible;
use embedded_hal::digital::ErrorType;
use embedded_hal_async::digital::Wait;
use stampfly_driver_core::Timebase;
use stampfly_driver_core::chip::Port;
use stampfly_types::{Duration, Instant};

/// How long after the time that samples are due the pin may still rise: half a period of the chip at 1600 Hz. The
/// chip's clock is off by some per cent, so the pin is usually the better one.
const LATE: Duration = Duration::from_micros(312);
/// How often in a row the pin may be wrong.
const PATIENCE: u8 = 4;

/// A pin, and how often in a row it was wrong.
#[derive(Debug)]
pub(super) struct Interrupt<P> {
    pin: Option<P>,
    wrong: u8,
    /// It is high, says the last wait.
    raised: bool,
}

impl Interrupt<NoPin> {
    pub(super) const fn none() -> Self {
        Self { pin: None, wrong: 0, raised: false }
    }
}

impl<P> Interrupt<P> {
    pub(super) fn release(self) -> Option<P> {
        self.pin
    }
}

impl<P: Wait> Interrupt<P> {
    pub(super) const fn on(pin: P) -> Self {
        Self { pin: Some(pin), wrong: 0, raised: false }
    }

    pub(super) const fn is_wired(&self) -> bool {
        self.pin.is_some()
    }

    /// Forgets what the pin did wrong.
    pub(super) const fn trust(&mut self) {
        self.wrong = 0;
    }

    /// Waits until samples are there: for the pin and a little, or until they are due when there is no pin.
    pub(super) async fn wait<R, T: Timebase>(&mut self, port: &mut Port<R, T>, due: Instant, little: Duration) {
        self.raised = false;
        match &mut self.pin {
            Some(pin) if self.wrong < PATIENCE && port.now() < due => {
                self.raised = matches!(port.until(due + LATE, pin.wait_for_high()).await, Some(Ok(())));
                if self.raised {
                    port.wait(little).await;
                } else {
                    self.wrong += 1;
                }
            }
            _ => port.wait_until(due).await,
        }
    }

    /// Compares what the pin said with what the chip says.
    pub(super) const fn judge(&mut self, samples: bool) {
        if self.raised {
            self.wrong = if samples { 0 } else { self.wrong.saturating_add(1) };
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
