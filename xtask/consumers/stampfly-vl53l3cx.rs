//! A stranger's program: how far away something is, with nothing but this crate added.

use std::convert::Infallible;
use stampfly_vl53l3cx::blocking::{Blocking, BlockingClock, block_on};
use stampfly_vl53l3cx::embedded_hal::delay::DelayNs;
use stampfly_vl53l3cx::embedded_hal::digital::{self, OutputPin};
use stampfly_vl53l3cx::embedded_hal::i2c::{ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation};
use stampfly_vl53l3cx::{BootAddress, ChipError, Config, Instant, RangeFinder, Vl53l3cx};

/// A bus with nobody on it, a pin that goes nowhere, and no time.
struct Nobody;

impl ErrorType for Nobody {
    type Error = ErrorKind;
}

impl I2c for Nobody {
    fn transaction(&mut self, _: u8, _: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
        Err(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address))
    }
}

impl digital::ErrorType for Nobody {
    type Error = Infallible;
}

impl OutputPin for Nobody {
    fn set_low(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
    fn set_high(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl DelayNs for Nobody {
    fn delay_ns(&mut self, _: u32) {}
}

fn main() {
    let (boot, clock) = (BootAddress::new(), BlockingClock::new(Nobody, || Instant::ZERO));
    let mut sensor = Vl53l3cx::new(Blocking(Nobody), Nobody, &boot, 0x30, clock, Config::default());
    let failed = block_on(sensor.next()).expect_err("nobody answers");
    assert_eq!(failed, ChipError::Bus(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address)));
}
