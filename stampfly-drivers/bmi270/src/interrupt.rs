//! The interrupt pin, which is optional.
//!
//! A pin that stays silent, is stuck high or is connected elsewhere delays a few samples and is
//! ignored afterwards: the driver computes without it when samples are due.

use core::convert::Infallible;
use embedded_hal::digital::ErrorType;
use embedded_hal_async::digital::Wait;
use stampfly_driver_core::Timebase;
use stampfly_driver_core::chip::Port;
use stampfly_types::{Duration, Instant};

/// Time after the samples are due during which the pin may still rise: half a sample period of the
/// chip at 1600 Hz. The chip's clock is off by some per cent, so the pin is usually more accurate
/// than the computed time.
const LATE: Duration = Duration::from_micros(312);
/// Number of consecutive errors after which the pin is ignored.
const PATIENCE: u8 = 4;

/// The pin, and its number of consecutive errors.
#[derive(Debug)]
pub(super) struct Interrupt<P> {
    pin: Option<P>,
    wrong: u8,
    /// The last wait ended with a high pin.
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

    /// Resets the error count.
    pub(super) const fn trust(&mut self) {
        self.wrong = 0;
    }

    /// Waits until samples are ready: for the pin plus `little`, or until they are due when there
    /// is no usable pin.
    pub(super) async fn wait<R, T: Timebase>(&mut self, port: &mut Port<R, T>, due: Instant, little: Duration) {
        self.raised = false;
        match &mut self.pin {
            // When samples are already due, the pin is high at best and waiting for it gains
            // nothing.
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

    /// Compares the pin with the chip's fill level, and counts errors.
    pub(super) const fn judge(&mut self, samples: bool) {
        if self.raised {
            self.wrong = if samples { 0 } else { self.wrong.saturating_add(1) };
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
