//! A stranger's program: a lamp and a barometer, from the crate that has every driver.

use stampfly_drivers::blocking::{BlockingClock, Blocking, block_on};
use stampfly_drivers::chip::bmp280::{Bmp280, Config};
use stampfly_drivers::embedded_hal::{delay::DelayNs, i2c};
use stampfly_drivers::smart_leds_trait::{RGB8, SmartLedsWrite};
use stampfly_drivers::stampfly_types::{Instant, messages::Signal};
use stampfly_drivers::{Barometer, Indicator, Lights, SensorError, SensorErrorKind};
use std::convert::Infallible;

/// Where colours, bytes and times go: nowhere.
struct Nowhere;

impl SmartLedsWrite for Nowhere {
    type Error = Infallible;
    type Color = RGB8;
    fn write<T, I>(&mut self, _: T) -> Result<(), Infallible>
    where
        T: IntoIterator<Item = I>,
        I: Into<RGB8>,
    {
        Ok(())
    }
}

impl i2c::ErrorType for Nowhere {
    type Error = i2c::ErrorKind;
}

impl i2c::I2c for Nowhere {
    fn transaction(&mut self, _: u8, _: &mut [i2c::Operation<'_>]) -> Result<(), i2c::ErrorKind> {
        Err(i2c::ErrorKind::Bus)
    }
}

impl DelayNs for Nowhere {
    fn delay_ns(&mut self, _: u32) {}
}

fn main() {
    let mut lights = Lights::<_, 1>::status(Nowhere);
    lights.show(&Signal::default());
    let clock = BlockingClock::new(Nowhere, || Instant::ZERO);
    let mut barometer = Bmp280::new(Blocking(Nowhere), Bmp280::SDO_LOW, clock, Config::default());
    assert_eq!(block_on(barometer.next()).map_err(|error| error.kind()), Err(SensorErrorKind::Bus));
}
