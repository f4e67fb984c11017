//! A VL53L3CX on an ESP32-C6 without an executor. Prints the distance on the serial port.
//!
//! Wiring: SDA GPIO6, SCL GPIO7, XSHUT GPIO10.
//!
//! Build it in `stampfly-drivers/boards/esp32`, which contains the versions of the crates and the
//! linker settings: `cargo run --release --example vl53l3cx`. On another ESP32 only the names of
//! the pins differ.

#![no_std]
#![no_main]

use esp_backtrace as _;
use esp_hal::delay::Delay;
use esp_hal::gpio::{Level, Output, OutputConfig};
use esp_hal::i2c::master::{Config as I2cConfig, I2c};
use esp_println::println;
use stampfly_vl53l3cx::blocking::{Blocking, BlockingClock, block_on};
use stampfly_vl53l3cx::{BootAddress, Config, Instant, RangeFinder, Vl53l3cx};

esp_bootloader_esp_idf::esp_app_desc!();

#[esp_hal::main]
fn main() -> ! {
    let board = esp_hal::init(esp_hal::Config::default());
    let now = || Instant::from_micros(esp_hal::time::Instant::now().duration_since_epoch().as_micros());
    let clock = BlockingClock::new(Delay::new(), now);
    let bus = I2c::new(board.I2C0, I2cConfig::default()).expect("a frequency it can do");
    let bus = bus.with_sda(board.GPIO6).with_scl(board.GPIO7);
    let xshut = Output::new(board.GPIO10, Level::Low, OutputConfig::default());
    let boot = BootAddress::new();
    let mut range = Vl53l3cx::new(Blocking(bus), xshut, &boot, 0x30, clock, Config::default());
    loop {
        match block_on(range.next()) {
            Ok(sample) => println!("{:.3} m, status {}", sample.data.distance, sample.data.status),
            Err(error) => {
                println!("{}", error);
                Delay::new().delay_millis(100);
            }
        }
    }
}
