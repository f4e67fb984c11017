//! A stranger's program, with nothing but this crate added: the first example of its README.

use stampfly_ina3221::blocking::{Blocking, BlockingClock, block_on};
use stampfly_ina3221::embedded_hal::{delay::DelayNs, i2c};
use stampfly_ina3221::{Config, Ina3221, Instant, PowerMonitor};

/// Stands for the bus and the delay of your board: nobody answers here.
struct Board;

impl i2c::ErrorType for Board {
    type Error = i2c::ErrorKind;
}

impl i2c::I2c for Board {
    fn transaction(&mut self, _: u8, _: &mut [i2c::Operation<'_>]) -> Result<(), i2c::ErrorKind> {
        Err(i2c::ErrorKind::Bus)
    }
}

impl DelayNs for Board {
    fn delay_ns(&mut self, _: u32) {}
}

fn main() {
    // A function that tells the time since power-on.
    let clock = BlockingClock::new(Board, || Instant::ZERO);
    let mut sensor = Ina3221::new(Blocking(Board), Ina3221::A0_GROUND, clock, Config::default());
    match block_on(sensor.next()) {
        Ok(sample) => println!("{} V, {} A", sample.data.voltage, sample.data.current),
        Err(error) => println!("{error}"),
    }
}
