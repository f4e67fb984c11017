//! An MPU-6000 on a computer with Linux, such as a Raspberry Pi. Prints acceleration and angular
//! rate.
//!
//! Wiring: SPI at `/dev/spidev0.0`.
//!
//! Build it in `stampfly-drivers/boards/linux`, which contains the versions of the crates:
//! `cargo run --example mpu6000`.

use linux_embedded_hal::spidev::{SpiModeFlags, SpidevOptions};
use linux_embedded_hal::{Delay, SpidevDevice};
use stampfly_mpu6000::blocking::{Blocking, BlockingClock, block_on};
use stampfly_mpu6000::{AxisMap, Config, Imu, Instant, Mpu6000};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let start = std::time::Instant::now();
    let clock = BlockingClock::new(Delay, move || Instant::from_micros(start.elapsed().as_micros() as u64));
    let mut device = SpidevDevice::open("/dev/spidev0.0")?;
    device.configure(&SpidevOptions::new().max_speed_hz(1_000_000).mode(SpiModeFlags::SPI_MODE_3).build())?;
    let mut imu = Mpu6000::new(Blocking(device), clock, AxisMap::IDENTITY, Config::default());
    loop {
        let sample = block_on(imu.next())?;
        let (accel, gyro) = (sample.data.accel, sample.data.gyro);
        println!("{:.2} {:.2} {:.2} m/s², {:.3} {:.3} {:.3} rad/s", accel.x, accel.y, accel.z, gyro.x, gyro.y, gyro.z);
    }
}
