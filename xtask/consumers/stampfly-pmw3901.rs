//! A stranger's program: the flow of the floor, with nothing but this crate added.

use stampfly_pmw3901::blocking::{Blocking, BlockingClock, block_on};
use stampfly_pmw3901::embedded_hal::delay::DelayNs;
use stampfly_pmw3901::embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use stampfly_pmw3901::{AxisMap, ChipError, Config, Instant, OpticalFlow, Pmw3901};

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
    let mut sensor = Pmw3901::new(Blocking(Nobody), clock, AxisMap::IDENTITY, Config::default());
    let failed = block_on(sensor.next()).expect_err("nobody answers");
    assert_eq!(failed, ChipError::Bus(ErrorKind::ModeFault));
}
