//! A stranger's program: the turn of a board, with nothing but this crate added.

use stampfly_bmi270::blocking::{Blocking, BlockingClock, block_on};
use stampfly_bmi270::embedded_hal::delay::DelayNs;
use stampfly_bmi270::embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use stampfly_bmi270::{AxisMap, Bmi270, ChipError, Config, Imu, Instant};

/// A bus with nobody on it.
struct Nobody;

impl ErrorType for Nobody {
    type Error = ErrorKind;
}

impl SpiDevice for Nobody {
    fn transaction(&mut self, _: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        Err(ErrorKind::ModeFault)
    }
}

struct Delay;

impl DelayNs for Delay {
    fn delay_ns(&mut self, _: u32) {}
}

fn main() {
    let clock = BlockingClock::new(Delay, || Instant::ZERO);
    let mut sensor = Bmi270::spi(Blocking(Nobody), clock, &[0; 8192], AxisMap::IDENTITY, Config::default());
    let failed = block_on(sensor.next()).expect_err("nobody answers");
    assert_eq!(failed, ChipError::Bus(ErrorKind::ModeFault));
}
