//! An nRF24L01+ on an ESP32-C6 without an executor. Prints the packets received on channel 40 on
//! the serial port.
//!
//! Wiring: SCK GPIO18, SDI GPIO19, SDO GPIO20, chip select GPIO21, CE GPIO22.
//!
//! Build it in `stampfly-drivers/boards/esp32`, which contains the versions of the crates and the
//! linker settings: `cargo run --release --example nrf24l01`. On another ESP32 only the names of
//! the pins differ.

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
use stampfly_nrf24l01::blocking::{Blocking, BlockingClock, block_on};
use stampfly_nrf24l01::{Config, Duration, Instant, Nrf24l01, Tuning};

esp_bootloader_esp_idf::esp_app_desc!();

/// Settings of the transmitter: ten bytes at 1 Mbit/s, with a CRC of two bytes and without
/// acknowledgement.
const TUNING: Tuning = Tuning { channel: 40, address: [1, 2, 3, 4, 5] };

#[esp_hal::main]
fn main() -> ! {
    let board = esp_hal::init(esp_hal::Config::default());
    let now = || Instant::from_micros(esp_hal::time::Instant::now().duration_since_epoch().as_micros());
    let clock = BlockingClock::new(Delay::new(), now);
    let config = SpiConfig::default().with_frequency(Rate::from_mhz(8)).with_mode(Mode::_0);
    let bus = Spi::new(board.SPI2, config).expect("a frequency it can do");
    let bus = bus.with_sck(board.GPIO18).with_mosi(board.GPIO19).with_miso(board.GPIO20);
    let select = Output::new(board.GPIO21, Level::High, OutputConfig::default());
    let Ok(device) = ExclusiveDevice::new(bus, select, Delay::new());
    let enable = Output::new(board.GPIO22, Level::Low, OutputConfig::default());
    let mut radio = Nrf24l01::<_, _, _, _, 10>::new(Blocking(device), enable, clock, Config::default());
    loop {
        let received = block_on(async {
            radio.listen(TUNING).await?;
            radio.wait(now() + Duration::from_secs(1)).await
        });
        match received {
            Ok(Some(packet)) => println!("{}: {:?}", packet.at, packet.payload),
            Ok(None) => {}
            Err(error) => {
                println!("{}", error);
                Delay::new().delay_millis(100);
            }
        }
    }
}
