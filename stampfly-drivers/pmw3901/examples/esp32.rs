//! A PMW3901 on an ESP32-C6 without an executor. Prints the motion of the image on the serial port.
//!
//! Wiring: SCK GPIO18, SDI GPIO19, SDO GPIO20, chip select GPIO21.
//!
//! Build it in `stampfly-drivers/boards/esp32`, which contains the versions of the crates and the
//! linker settings: `cargo run --release --example pmw3901`. On another ESP32 only the names of the
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
use stampfly_pmw3901::blocking::{Blocking, BlockingClock, block_on};
use stampfly_pmw3901::{AxisMap, Config, Instant, OpticalFlow, Pmw3901};

esp_bootloader_esp_idf::esp_app_desc!();

#[esp_hal::main]
fn main() -> ! {
    let board = esp_hal::init(esp_hal::Config::default());
    let now = || Instant::from_micros(esp_hal::time::Instant::now().duration_since_epoch().as_micros());
    let clock = BlockingClock::new(Delay::new(), now);
    let config = SpiConfig::default().with_frequency(Rate::from_mhz(2)).with_mode(Mode::_3);
    let bus = Spi::new(board.SPI2, config).expect("a frequency it can do");
    let bus = bus.with_sck(board.GPIO18).with_mosi(board.GPIO19).with_miso(board.GPIO20);
    let select = Output::new(board.GPIO21, Level::High, OutputConfig::default());
    let Ok(device) = ExclusiveDevice::new(bus, select, Delay::new());
    let mut flow = Pmw3901::new(Blocking(device), clock, AxisMap::IDENTITY, Config::default());
    loop {
        match block_on(flow.next()) {
            Ok(sample) => println!(
                "{:.3} {:.3} rad in {:.3} s, quality {}",
                sample.data.delta_x, sample.data.delta_y, sample.data.interval, sample.data.quality
            ),
            Err(error) => {
                println!("{}", error);
                Delay::new().delay_millis(100);
            }
        }
    }
}
