//! A BMI270 on a computer with Linux, such as a Raspberry Pi. Prints acceleration and angular rate.
//!
//! Wiring: I2C at `/dev/i2c-1`, or SPI at `/dev/spidev0.0` with the argument `spi`.
//!
//! Build it in `stampfly-drivers/boards/linux`, which contains the versions of the crates:
//! `cargo run --example bmi270` or `cargo run --example bmi270 spi`.

use bmi2::config::BMI270_CONFIG_FILE;
use linux_embedded_hal::spidev::{SpiModeFlags, SpidevOptions};
use linux_embedded_hal::{Delay, I2cdev, SpidevDevice};
use stampfly_bmi270::blocking::{Blocking, BlockingClock, block_on};
use stampfly_bmi270::{AxisMap, Bmi270, Config, Imu, Instant};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let start = std::time::Instant::now();
    let clock = BlockingClock::new(Delay, move || Instant::from_micros(start.elapsed().as_micros() as u64));
    if std::env::args().any(|argument| argument == "spi") {
        let mut device = SpidevDevice::open("/dev/spidev0.0")?;
        device.configure(&SpidevOptions::new().max_speed_hz(10_000_000).mode(SpiModeFlags::SPI_MODE_3).build())?;
        show(Bmi270::spi(Blocking(device), clock, &BMI270_CONFIG_FILE, AxisMap::IDENTITY, Config::default()))
    } else {
        let bus = I2cdev::new("/dev/i2c-1")?;
        show(Bmi270::i2c(Blocking(bus), 0x68, clock, &BMI270_CONFIG_FILE, AxisMap::IDENTITY, Config::default()))
    }
}

/// Prints samples of an IMU on either bus.
fn show<E: Error + 'static>(mut imu: impl Imu<Error = E>) -> Result<(), Box<dyn Error>> {
    loop {
        let sample = block_on(imu.next())?;
        let (accel, gyro) = (sample.data.accel, sample.data.gyro);
        println!(
            "{:7.2} {:7.2} {:7.2} m/s², {:6.2} {:6.2} {:6.2} rad/s",
            accel.x, accel.y, accel.z, gyro.x, gyro.y, gyro.z
        );
    }
}
