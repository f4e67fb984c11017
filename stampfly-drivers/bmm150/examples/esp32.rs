//! A BMM150 on an ESP32-C6 without an executor. Prints the magnetic field along the chip's axes on
//! the serial port.
//!
//! Wiring: SDA GPIO6, SCL GPIO7.
//!
//! Build it in `stampfly-drivers/boards/esp32`, which contains the versions of the crates and the
//! linker settings: `cargo run --release --example bmm150`. On another ESP32 only the names of the
//! pins differ.

#![no_std]
#![no_main]

use esp_backtrace as _;
use esp_hal::delay::Delay;
use esp_hal::i2c::master::{Config as I2cConfig, I2c};
use esp_println::println;
use stampfly_bmm150::blocking::{Blocking, BlockingClock, block_on};
use stampfly_bmm150::{AxisMap, Bmm150, Config, Instant, Magnetometer};

esp_bootloader_esp_idf::esp_app_desc!();

#[esp_hal::main]
fn main() -> ! {
    let board = esp_hal::init(esp_hal::Config::default());
    let now = || Instant::from_micros(esp_hal::time::Instant::now().duration_since_epoch().as_micros());
    let clock = BlockingClock::new(Delay::new(), now);
    let bus = I2c::new(board.I2C0, I2cConfig::default()).expect("a frequency it can do");
    let bus = bus.with_sda(board.GPIO6).with_scl(board.GPIO7);
    let mut compass = Bmm150::i2c(Blocking(bus), Bmm150::ALL_LOW, clock, AxisMap::IDENTITY, Config::default());
    loop {
        match block_on(compass.next()) {
            Ok(sample) => {
                let field = sample.data.field;
                println!("{:.1} {:.1} {:.1} µT", field.x, field.y, field.z);
            }
            Err(error) => {
                println!("{}", error);
                Delay::new().delay_millis(100);
            }
        }
    }
}
