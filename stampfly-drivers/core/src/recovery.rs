//! Frees an I2C bus whose data line a device holds low.
//!
//! A device that was interrupted while it sent a zero (by a reset of the processor or a glitch on
//! the clock line) waits for further clocks, and every transfer fails until it gets them. When
//! every device on the bus fails, the owner of the bus takes the pins from the peripheral,
//! configures them as open drain, calls [`recover_i2c`] and returns the pins to the peripheral.
//!
//! Not for drivers, because they share the bus. It does not help against a device that holds the
//! *clock* line low: that device needs a reset or a power cycle.

use core::fmt;
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_hal_async::delay::DelayNs;

/// Half a clock period at 100 kHz, µs.
const HALF_CLOCK: u32 = 5;
/// Eight data bits and the acknowledge bit, which the host leaves high: the device then stops
/// sending.
const CLOCKS: u8 = 9;
/// Total number of half clocks for which devices may stretch the clock: 500 µs.
const PATIENCE: u8 = 100;

/// State of the bus before a successful recovery.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Recovery {
    /// The data line was free. A STOP was sent nevertheless.
    WasFree,
    /// A device held the data line low and released it after `clocks` clocks.
    Freed {
        /// 1 to 9.
        clocks: u8,
    },
}

/// Reason why the bus is not free.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RecoveryError {
    /// The clock line stays low: a short circuit, no supply, or a device that stretches the clock
    /// without end.
    ClockStuck,
    /// The data line stays low after nine clocks.
    DataStuck,
    /// A pin could not be set or read.
    Pin,
}

impl fmt::Display for RecoveryError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ClockStuck => "the clock line stays low",
            Self::DataStuck => "the data line stays low after nine clocks",
            Self::Pin => "a pin could not be set or read",
        })
    }
}

impl core::error::Error for RecoveryError {}

/// Sends clocks until the data line is free, then a STOP (UM10204 §3.1.16). Takes at most 1 ms,
/// measured by `delay`.
///
/// Both pins are open drain: setting a pin high releases its line, and reading it returns the
/// line's level.
///
/// # Errors
/// When the bus is not free afterwards. Both lines are released nevertheless, and the caller may
/// try again.
///
/// ```
/// # use core::convert::Infallible;
/// # use embedded_hal::{delay::DelayNs, digital::{ErrorType, InputPin, OutputPin}};
/// # struct Free(bool);
/// # impl ErrorType for Free { type Error = Infallible; }
/// # impl OutputPin for Free {
/// #     fn set_low(&mut self) -> Result<(), Infallible> { self.0 = false; Ok(()) }
/// #     fn set_high(&mut self) -> Result<(), Infallible> { self.0 = true; Ok(()) }
/// # }
/// # impl InputPin for Free {
/// #     fn is_low(&mut self) -> Result<bool, Infallible> { Ok(!self.0) }
/// #     fn is_high(&mut self) -> Result<bool, Infallible> { Ok(self.0) }
/// # }
/// # struct Delay;
/// # impl DelayNs for Delay { fn delay_ns(&mut self, _: u32) {} }
/// # let (mut scl, mut sda, delay) = (Free(true), Free(true), Delay);
/// use stampfly_driver_core::blocking::{Blocking, block_on};
/// use stampfly_driver_core::{Recovery, recover_i2c};
///
/// let outcome = block_on(recover_i2c(&mut scl, &mut sda, &mut Blocking(delay)));
/// assert_eq!(outcome, Ok(Recovery::WasFree));
/// ```
pub async fn recover_i2c<C, D>(scl: &mut C, sda: &mut D, delay: &mut impl DelayNs) -> Result<Recovery, RecoveryError>
where
    C: InputPin + OutputPin,
    D: InputPin + OutputPin,
{
    let mut lines = Lines { scl, sda, delay, patience: PATIENCE };
    let outcome = lines.recover().await;
    // Both lines are released in any case, so that the peripheral can take over.
    let released = (lines.scl.set_high(), lines.sda.set_high());
    if released.0.is_err() || released.1.is_err() { outcome.and(Err(RecoveryError::Pin)) } else { outcome }
}

struct Lines<'a, C, D, W> {
    scl: &'a mut C,
    sda: &'a mut D,
    delay: &'a mut W,
    patience: u8,
}

impl<C: InputPin + OutputPin, D: InputPin + OutputPin, W: DelayNs> Lines<'_, C, D, W> {
    async fn recover(&mut self) -> Result<Recovery, RecoveryError> {
        self.sda.set_high().map_err(|_| RecoveryError::Pin)?;
        self.clock_high().await?;
        for clocks in 0..=CLOCKS {
            if clocks > 0 {
                self.clock_low().await?;
                self.clock_high().await?;
            }
            // A device in the middle of a byte may be sending a one, which looks like a free line.
            // The STOP fails then, and the loop sends the next clock.
            if self.is_free()? && self.stop().await? {
                return Ok(if clocks == 0 { Recovery::WasFree } else { Recovery::Freed { clocks } });
            }
        }
        Err(RecoveryError::DataStuck)
    }

    /// Sends a STOP: a rising data line while the clock is high. Returns whether the data line
    /// rose.
    async fn stop(&mut self) -> Result<bool, RecoveryError> {
        self.clock_low().await?;
        self.sda.set_low().map_err(|_| RecoveryError::Pin)?;
        self.clock_high().await?;
        self.sda.set_high().map_err(|_| RecoveryError::Pin)?;
        self.delay.delay_us(HALF_CLOCK).await;
        self.is_free()
    }

    fn is_free(&mut self) -> Result<bool, RecoveryError> {
        self.sda.is_high().map_err(|_| RecoveryError::Pin)
    }

    async fn clock_low(&mut self) -> Result<(), RecoveryError> {
        self.scl.set_low().map_err(|_| RecoveryError::Pin)?;
        self.delay.delay_us(HALF_CLOCK).await;
        Ok(())
    }

    async fn clock_high(&mut self) -> Result<(), RecoveryError> {
        self.scl.set_high().map_err(|_| RecoveryError::Pin)?;
        self.delay.delay_us(HALF_CLOCK).await;
        // A device may stretch the clock; `patience` bounds the total over all clocks.
        while self.scl.is_low().map_err(|_| RecoveryError::Pin)? {
            self.patience = self.patience.checked_sub(1).ok_or(RecoveryError::ClockStuck)?;
            self.delay.delay_us(HALF_CLOCK).await;
        }
        Ok(())
    }
}
