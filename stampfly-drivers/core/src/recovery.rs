//! Frees an I2C bus on which a device holds the data line.
//!
//! A device that was interrupted while it sent a zero (a reset of the processor, a glitch on the clock) waits for clocks
//! that nobody sends, and every transfer fails until it gets them. Whoever owns the bus calls [`recover_i2c`] when
//! every device on it fails, with the pins taken from the peripheral and configured as open drain, and gives them back
//! afterwards. Not for drivers, which share the bus, and no help against a device that holds the *clock* line: that
//! one needs its reset pin or its power.

use core::fmt;
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_hal_async::delay::DelayNs;

/// Half a clock at 100 kHz, µs.
const HALF_CLOCK: u32 = 5;
/// A device that reads nine bits has read its acknowledgement, which is missing, and lets go.
const CLOCKS: u8 = 9;
/// Half clocks that the clock line may be stretched in all: 500 µs.
const PATIENCE: u8 = 100;

/// What was wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Recovery {
    /// Nothing: the data line was free. A STOP was sent nevertheless.
    WasFree,
    /// A device held the data line, and let go after this many clocks.
    Freed {
        /// 1 to 9.
        clocks: u8,
    },
}

/// Why the bus is not free.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RecoveryError {
    /// The clock line stays low: a short circuit, no supply, or a device that stretches the clock for ever.
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

/// Clocks the bus until nobody holds the data line, then sends a STOP (UM10204 §3.1.16). At most 1 ms, by this delay's
/// clock.
///
/// Both pins are open drain: high lets go of the line, and reading tells its level.
///
/// # Errors
/// When the bus is not free afterwards; both lines are let go nevertheless. Whoever is told so may call again.
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
            // A one of a device that goes on sending looks like a free line, but the STOP does not get through.
            if self.is_free()? && self.stop().await? {
                return Ok(if clocks == 0 { Recovery::WasFree } else { Recovery::Freed { clocks } });
            }
        }
        Err(RecoveryError::DataStuck)
    }

    /// Data rises while the clock is high; tells whether it did.
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
        while self.scl.is_low().map_err(|_| RecoveryError::Pin)? {
            self.patience = self.patience.checked_sub(1).ok_or(RecoveryError::ClockStuck)?;
            self.delay.delay_us(HALF_CLOCK).await;
        }
        Ok(())
    }
}
