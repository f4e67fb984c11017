//! The reset line of a chip, which is optional.
//!
//! Prefer a pin: it also resets a chip that no longer responds on the bus, and with several chips
//! on a bus all but one need it. Without a pin the driver resets the chip by a register.

use core::convert::Infallible;
use embedded_hal::digital::OutputPin;

/// The XSHUT line of a chip. Implemented by every [`OutputPin`], low for reset, and by [`NoXshut`].
pub trait Xshut {
    /// Error of the line.
    type Error;
    /// Whether the line is connected. If not, the driver resets the chip by a register.
    const WIRED: bool;

    /// Holds the chip in reset.
    ///
    /// # Errors
    /// When the pin refuses.
    fn hold(&mut self) -> Result<(), Self::Error>;

    /// Releases the chip from reset.
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

/// A board on which XSHUT is connected to the supply.
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
