//! A stranger's program, with nothing but this crate added: the first example of its README.

use stampfly_bmi270::blocking::{Blocking, BlockingClock, block_on};
use stampfly_bmi270::embedded_hal::{delay::DelayNs, spi};
use stampfly_bmi270::{AxisMap, Bmi270, Config, Imu, Instant};

/// Stands for the bus and the delay of your board: nobody answers here.
struct Board;

impl spi::ErrorType for Board {
    type Error = spi::ErrorKind;
}

impl spi::SpiDevice for Board {
    fn transaction(&mut self, _: &mut [spi::Operation<'_, u8>]) -> Result<(), spi::ErrorKind> {
        Err(spi::ErrorKind::Other)
    }
}

impl DelayNs for Board {
    fn delay_ns(&mut self, _: u32) {}
}

fn main() {
    // A function that tells the time since power-on.
    let clock = BlockingClock::new(Board, || Instant::ZERO);
    // Bosch's: see below.
    let file = [0; 8192];
    let mut sensor = Bmi270::spi(Blocking(Board), clock, &file, AxisMap::IDENTITY, Config::default());
    match block_on(sensor.next()) {
        Ok(sample) => println!("{:?} m/s², {:?} rad/s", sample.data.accel, sample.data.gyro),
        Err(error) => println!("{error}"),
    }
}
