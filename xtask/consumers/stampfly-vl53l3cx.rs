//! A stranger's program: how far away something is, with nothing but this crate added.

use std::cell::Cell;
use std::convert::Infallible;
use stampfly_vl53l3cx::blocking::{Blocking, BlockingClock, block_on};
use stampfly_vl53l3cx::embedded_hal::delay::DelayNs;
use stampfly_vl53l3cx::embedded_hal::digital::{self, OutputPin};
use stampfly_vl53l3cx::embedded_hal::i2c::{ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation};
use stampfly_vl53l3cx::{BootAddress, ChipError, Config, Instant, RangeFinder, Vl53l3cx};

/// A bus with nobody on it, and a pin that goes nowhere.
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

/// Time that passes when somebody waits, ns.
#[derive(Clone, Copy)]
struct Delay<'a>(&'a Cell<u64>);

impl DelayNs for Delay<'_> {
    fn delay_ns(&mut self, ns: u32) {
        self.0.set(self.0.get() + u64::from(ns));
    }
}

fn main() {
    let (boot, nanos) = (BootAddress::new(), Cell::new(0));
    let clock = BlockingClock::new(Delay(&nanos), || Instant::from_micros(nanos.get() / 1_000));
    let mut sensor = Vl53l3cx::new(Blocking(Nobody), Nobody, &boot, 0x30, clock, Config::default());
    let failed = block_on(sensor.next()).expect_err("nobody answers");
    assert_eq!(failed, ChipError::Bus(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address)));
}
