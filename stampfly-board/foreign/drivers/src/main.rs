//! Three drivers, one after the other on one I2C bus: SDA at GPIO4, SCL at GPIO5, XSHUT at GPIO6. Each says on UART 0 what it
//! found. The sensors are labwired's, written by people who did not read our drivers from data sheets that we read, too.
//!
//! `cargo xtask foreign` builds this, runs it and judges what it says. It is no example: those are in each chip's crate.

#![no_std]
#![no_main]

use bmi2::config::BMI270_CONFIG_FILE;
use core::fmt::Display;
use esp_backtrace as _;
use esp_hal::delay::Delay;
use esp_hal::gpio::{Level, Output, OutputConfig};
use esp_hal::i2c::master::{Config as I2cConfig, I2c};
use esp_println::println;
use stampfly_bmi270::blocking::{Blocking, BlockingClock, block_on};
use stampfly_bmi270::{AxisMap, Bmi270, Imu, Instant};
use stampfly_bmp280::{Barometer, Bmp280};
use stampfly_vl53l3cx::{BootAddress, RangeFinder, Vl53l3cx};

esp_bootloader_esp_idf::esp_app_desc!();

#[esp_hal::main]
fn main() -> ! {
    let board = esp_hal::init(esp_hal::Config::default());
    let now = || Instant::from_micros(esp_hal::time::Instant::now().duration_since_epoch().as_micros());
    let clock = || BlockingClock::new(Delay::new(), now);
    let bus = I2c::new(board.I2C0, I2cConfig::default()).expect("a frequency it can do");
    let mut bus = bus.with_sda(board.GPIO4).with_scl(board.GPIO5);

    let mut barometer = Bmp280::i2c(Blocking(&mut bus), Bmp280::SDO_LOW, clock(), stampfly_bmp280::Config::default());
    match block_on(barometer.next()) {
        Ok(sample) => println!("bmp280: {} Pa, {} °C", sample.data.pressure, sample.data.temperature),
        Err(error) => refused("bmp280", error),
    }

    let xshut = Output::new(board.GPIO6, Level::Low, OutputConfig::default());
    let boot = BootAddress::new();
    let config = stampfly_vl53l3cx::Config::default();
    let mut range = Vl53l3cx::new(Blocking(&mut bus), xshut, &boot, 0x30, clock(), config);
    match block_on(range.next()) {
        Ok(sample) => println!("vl53l3cx: {} m, status {}", sample.data.distance, sample.data.status),
        Err(error) => refused("vl53l3cx", error),
    }

    let (wires, config) = (Blocking(&mut bus), stampfly_bmi270::Config::default());
    let mut imu = Bmi270::i2c(wires, 0x68, clock(), &BMI270_CONFIG_FILE, AxisMap::IDENTITY, config);
    match block_on(imu.start()) {
        Ok(()) => println!("bmi270: started"),
        Err(error) => refused("bmi270", error),
    }
    match block_on(imu.next()) {
        Ok(sample) => println!("bmi270: {} m/s²", sample.data.accel.z),
        Err(error) => refused("bmi270", error),
    }
    println!("done");
    loop {
        core::hint::spin_loop();
    }
}

fn refused(chip: &str, error: impl Display) {
    println!("{chip}: refused, {error}");
}
