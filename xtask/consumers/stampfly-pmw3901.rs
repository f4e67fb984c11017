//! A stranger's program, with nothing but this crate added: the first example of its README.

use stampfly_pmw3901::blocking::{Blocking, BlockingClock, block_on};
use stampfly_pmw3901::embedded_hal::{delay::DelayNs, spi};
use stampfly_pmw3901::{AxisMap, Config, Instant, OpticalFlow, Pmw3901};

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
    let mut sensor = Pmw3901::new(Blocking(Board), clock, AxisMap::IDENTITY, Config::default());
    match block_on(sensor.next()) {
        Ok(sample) => println!("{} rad about x, quality {}", sample.data.delta_x, sample.data.quality),
        Err(error) => println!("{error}"),
    }
}
