//! The line that keeps a chip in reset, or that there is none.
//!
//! A pin is the surer way: it stops a chip that understands nothing any more, and several chips on a bus need one each but for one of
//! them. Without a pin a register has to do.

use core::convert::Infallible;
use embedded_hal::digital::OutputPin;

/// What a driver does with its chip's XSHUT. Any [`OutputPin`] is one, low holding the chip; so is [`NoXshut`].
pub trait Xshut {
    /// Why it could not be set.
    type Error;
    /// Is the line wired? A driver without it resets its chip by a register.
    const WIRED: bool;

    /// Holds the chip in reset.
    ///
    /// # Errors
    /// When the pin refuses.
    fn hold(&mut self) -> Result<(), Self::Error>;

    /// Lets the chip go.
    ///
    /// # Errors
    /// When the pin refuses.
    fn release(&mut self) -> Result<(), Self::Error>;
}

impl<P: OutputPin> Xshut for P {
    type Error = P::Error;
    const WIRED: bool = true;

    fn hold(&mut self) -> Result<(), P::Error> {
        self.set_low()
    }

    fn release(&mut self) -> Result<(), P::Error> {
        self.set_high()
    }
}

/// A board without the line: XSHUT is tied to the supply.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoXshut;

impl Xshut for NoXshut {
    type Error = Infallible;
    const WIRED: bool = false;

    fn hold(&mut self) -> Result<(), Infallible> {
        Ok(())
    }

    fn release(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
