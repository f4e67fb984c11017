//! A VL53L3CX on an STM32F411 ("Black Pill"). Prints the distance through the debug probe.
//!
//! Wiring: SDA PB9, SCL PB8, XSHUT PB7.
//!
//! Build it in `stampfly-drivers/boards/stm32`, which contains the versions of the crates and the
//! linker settings: `cargo run --release --example vl53l3cx`.

#![no_std]
#![no_main]

use defmt::{info, warn};
use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_stm32::bind_interrupts;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::peripherals::{DMA1_CH0, DMA1_CH6, I2C1};
use embassy_stm32::{dma, i2c};
use embassy_time::Timer;
use panic_probe as _;
use stampfly_vl53l3cx::{BootAddress, Config, EmbassyClock, RangeFinder, Vl53l3cx};

bind_interrupts!(struct Interrupts {
    I2C1_EV => i2c::EventInterruptHandler<I2C1>;
    I2C1_ER => i2c::ErrorInterruptHandler<I2C1>;
    DMA1_STREAM0 => dma::InterruptHandler<DMA1_CH0>;
    DMA1_STREAM6 => dma::InterruptHandler<DMA1_CH6>;
});

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let board = embassy_stm32::init(Default::default());
    let (scl, sda, send, receive) = (board.PB8, board.PB9, board.DMA1_CH6, board.DMA1_CH0);
    let bus = i2c::I2c::new(board.I2C1, scl, sda, send, receive, Interrupts, i2c::Config::default());
    let xshut = Output::new(board.PB7, Level::Low, Speed::Low);
    let boot = BootAddress::new();
    let mut range = Vl53l3cx::new(bus, xshut, &boot, 0x30, EmbassyClock, Config::default());
    loop {
        match range.next().await {
            Ok(sample) => info!("{} m, status {}", sample.data.distance, sample.data.status),
            Err(error) => {
                warn!("{}", error);
                Timer::after_millis(100).await;
            }
        }
    }
}
