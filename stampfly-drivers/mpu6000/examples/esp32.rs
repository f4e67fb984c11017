//! An MPU-6000 on an ESP32-C6 without an executor. Prints acceleration and angular rate on the
//! serial port.
//!
//! Wiring: SCK GPIO18, SDI GPIO19, SDO GPIO20, chip select GPIO21.
//!
//! Build it in `stampfly-drivers/boards/esp32`, which contains the versions of the crates and the
//! linker settings: `cargo run --release --example mpu6000`. On another ESP32 only the names of the
//! pins differ.

#![no_std]
#![no_main]

use embedded_hal_bus::spi::ExclusiveDevice;
use esp_backtrace as _;
use esp_hal::delay::Delay;
use esp_hal::gpio::{Level, Output, OutputConfig};
use esp_hal::spi::Mode;
use esp_hal::spi::master::{Config as SpiConfig, Spi};
use esp_hal::time::Rate;
use esp_println::println;
use stampfly_mpu6000::blocking::{Blocking, BlockingClock, block_on};
use stampfly_mpu6000::{AxisMap, Config, Imu, Instant, Mpu6000};

esp_bootloader_esp_idf::esp_app_desc!();

#[esp_hal::main]
fn main() -> ! {
    let board = esp_hal::init(esp_hal::Config::default());
    let now = || Instant::from_micros(esp_hal::time::Instant::now().duration_since_epoch().as_micros());
    let clock = BlockingClock::new(Delay::new(), now);
    let config = SpiConfig::default().with_frequency(Rate::from_mhz(1)).with_mode(Mode::_3);
    let bus = Spi::new(board.SPI2, config).expect("a frequency it can do");
    let bus = bus.with_sck(board.GPIO18).with_mosi(board.GPIO19).with_miso(board.GPIO20);
    let select = Output::new(board.GPIO21, Level::High, OutputConfig::default());
    let Ok(device) = ExclusiveDevice::new(bus, select, Delay::new());
    let mut imu = Mpu6000::new(Blocking(device), clock, AxisMap::IDENTITY, Config::default());
    loop {
        match block_on(imu.next()) {
            Ok(sample) => {
                let (accel, gyro) = (sample.data.accel, sample.data.gyro);
                println!(
                    "{:.2} {:.2} {:.2} m/s², {:.3} {:.3} {:.3} rad/s",
                    accel.x, accel.y, accel.z, gyro.x, gyro.y, gyro.z
                );
            }
            Err(error) => {
                println!("{}", error);
                Delay::new().delay_millis(100);
            }
        }
    }
}
