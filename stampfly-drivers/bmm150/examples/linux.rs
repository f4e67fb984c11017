//! A BMM150 on a computer with Linux, such as a Raspberry Pi. Prints the magnetic field along the
//! chip's axes.
//!
//! Wiring: I2C at `/dev/i2c-1`, or SPI at `/dev/spidev0.0` with the argument `spi`.
//!
//! Build it in `stampfly-drivers/boards/linux`, which contains the versions of the crates:
//! `cargo run --example bmm150` or `cargo run --example bmm150 spi`.

use linux_embedded_hal::spidev::{SpiModeFlags, SpidevOptions};
use linux_embedded_hal::{Delay, I2cdev, SpidevDevice};
use stampfly_bmm150::blocking::{Blocking, BlockingClock, block_on};
use stampfly_bmm150::{AxisMap, Bmm150, Config, Instant, Magnetometer};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let start = std::time::Instant::now();
    let clock = BlockingClock::new(Delay, move || Instant::from_micros(start.elapsed().as_micros() as u64));
    if std::env::args().any(|argument| argument == "spi") {
        let mut device = SpidevDevice::open("/dev/spidev0.0")?;
        device.configure(&SpidevOptions::new().max_speed_hz(10_000_000).mode(SpiModeFlags::SPI_MODE_3).build())?;
        show(Bmm150::spi(Blocking(device), clock, AxisMap::IDENTITY, Config::default()))
    } else {
        let bus = I2cdev::new("/dev/i2c-1")?;
        show(Bmm150::i2c(Blocking(bus), Bmm150::ALL_LOW, clock, AxisMap::IDENTITY, Config::default()))
    }
}

/// Prints samples of a magnetometer on either bus.
fn show<E: Error + 'static>(mut compass: impl Magnetometer<Error = E>) -> Result<(), Box<dyn Error>> {
    loop {
        let sample = block_on(compass.next())?;
        let field = sample.data.field;
        println!("{:.1} {:.1} {:.1} µT", field.x, field.y, field.z);
    }
}
