//! A BMP280 on a computer with Linux, such as a Raspberry Pi. Prints pressure, temperature and
//! height.
//!
//! Wiring: I2C at `/dev/i2c-1`, or SPI at `/dev/spidev0.0` with the argument `spi`.
//!
//! Build it in `stampfly-drivers/boards/linux`, which contains the versions of the crates:
//! `cargo run --example bmp280` or `cargo run --example bmp280 spi`.

use linux_embedded_hal::spidev::{SpiModeFlags, SpidevOptions};
use linux_embedded_hal::{Delay, I2cdev, SpidevDevice};
use stampfly_bmp280::blocking::{Blocking, BlockingClock, block_on};
use stampfly_bmp280::{Barometer, Bmp280, Config, Instant};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let start = std::time::Instant::now();
    let clock = BlockingClock::new(Delay, move || Instant::from_micros(start.elapsed().as_micros() as u64));
    if std::env::args().any(|argument| argument == "spi") {
        let mut device = SpidevDevice::open("/dev/spidev0.0")?;
        device.configure(&SpidevOptions::new().max_speed_hz(10_000_000).mode(SpiModeFlags::SPI_MODE_3).build())?;
        show(Bmp280::spi(Blocking(device), clock, Config::default()))
    } else {
        let bus = I2cdev::new("/dev/i2c-1")?;
        show(Bmp280::i2c(Blocking(bus), Bmp280::SDO_LOW, clock, Config::default()))
    }
}

/// Prints samples of a barometer on either bus.
fn show<E: Error + 'static>(mut barometer: impl Barometer<Error = E>) -> Result<(), Box<dyn Error>> {
    loop {
        let sample = block_on(barometer.next())?;
        println!("{} Pa, {} °C, {:.2} m", sample.data.pressure, sample.data.temperature, sample.data.altitude);
    }
}
