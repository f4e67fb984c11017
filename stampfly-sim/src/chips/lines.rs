//! The two lines of an [`I2cBus`] as pins, for a driver that takes them from the controller to
//! recover the bus.

use super::I2cBus;
use core::convert::Infallible;
use embedded_hal::digital::{ErrorType, InputPin, OutputPin};
use stampfly_drivers::shared::RecoverableI2c;
use stampfly_drivers::{Recovery, RecoveryError, recover_i2c};

/// Clock line, open drain. Every rising edge is a pulse seen by the chips.
#[derive(Clone, Debug)]
pub struct ClockLine {
    bus: I2cBus,
    high: bool,
}

/// Data line, open drain: low while any device pulls it.
#[derive(Clone, Debug)]
pub struct DataLine {
    bus: I2cBus,
    high: bool,
}

impl I2cBus {
    /// Both lines, released.
    #[must_use]
    pub fn lines(&self) -> (ClockLine, DataLine) {
        (ClockLine { bus: self.clone(), high: true }, DataLine { bus: self.clone(), high: true })
    }
}

impl RecoverableI2c for I2cBus {
    async fn recover(&mut self) -> Result<Recovery, RecoveryError> {
        let (mut clock_line, mut data_line) = self.lines();
        recover_i2c(&mut clock_line, &mut data_line, &mut self.clock()).await
    }
}

impl ErrorType for ClockLine {
    type Error = Infallible;
}

impl OutputPin for ClockLine {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.high = false;
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        if !core::mem::replace(&mut self.high, true) {
            self.bus.pulse_scl();
        }
        Ok(())
    }
}

impl InputPin for ClockLine {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(self.high)
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(!self.high)
    }
}

impl ErrorType for DataLine {
    type Error = Infallible;
}

impl OutputPin for DataLine {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.high = false;
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.high = true;
        Ok(())
    }
}

impl InputPin for DataLine {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(self.high && self.bus.sda_is_high())
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(!(self.high && self.bus.sda_is_high()))
    }
}
