//! A barometer on the I2C bus of a single-board computer with Linux, ten samples of it: for `docs/how-to-linux-driver.md`.
//!
//! It wants a BMP280 at `/dev/i2c-1`; without that bus it says so.

use linux_embedded_hal::{Delay, I2cdev};
use stampfly_drivers::Barometer;
use stampfly_drivers::blocking::{Blocking, BlockingClock, block_on};
use stampfly_drivers::chip::bmp280::{Bmp280, Config};
use stampfly_types::Instant;

// ANCHOR: all
fn main() {
    let bus = match I2cdev::new("/dev/i2c-1") {
        Ok(bus) => bus,
        Err(error) => return println!("/dev/i2c-1: {error}"),
    };
    // The time since the program began, and a way to wait.
    let begun = std::time::Instant::now();
    let clock = BlockingClock::new(Delay, move || Instant::from_micros(begun.elapsed().as_micros() as u64));

    let mut barometer = Bmp280::new(Blocking(bus), Bmp280::SDO_LOW, clock, Config::default());
    for _ in 0..10 {
        match block_on(barometer.next()) {
            Ok(sample) => println!("{:.3} s: {:.0} Pa", sample.at.seconds_f64(), sample.data.pressure),
            Err(error) => println!("{error}"),
        }
    }
}
// ANCHOR_END: all
