//! A stranger's program: the magnetic field, with nothing but this crate added.

use stampfly_bmm150::blocking::{Blocking, BlockingClock, block_on};
use stampfly_bmm150::embedded_hal::delay::DelayNs;
use stampfly_bmm150::embedded_hal::i2c::{ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation};
use stampfly_bmm150::{AxisMap, Bmm150, ChipError, Config, Instant, Magnetometer};

/// A bus with nobody on it.
struct Nobody;

impl ErrorType for Nobody {
    type Error = ErrorKind;
}

impl I2c for Nobody {
    fn transaction(&mut self, _: u8, _: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
        Err(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address))
    }
}

struct Delay;

impl DelayNs for Delay {
    fn delay_ns(&mut self, _: u32) {}
}

fn main() {
    let clock = BlockingClock::new(Delay, || Instant::ZERO);
    let mut sensor = Bmm150::new(Blocking(Nobody), Bmm150::ALL_LOW, clock, AxisMap::IDENTITY, Config::default());
    let failed = block_on(sensor.next()).expect_err("nobody answers");
    assert_eq!(failed, ChipError::Bus(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address)));
}
