//! An INA3221 on an STM32F411 ("Black Pill"). Prints voltage and current of one channel through the
//! debug probe.
//!
//! Wiring: SDA PB9, SCL PB8.
//!
//! Build it in `stampfly-drivers/boards/stm32`, which contains the versions of the crates and the
//! linker settings: `cargo run --release --example ina3221`.

#![no_std]
#![no_main]

use defmt::{info, warn};
use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_stm32::bind_interrupts;
use embassy_stm32::peripherals::{DMA1_CH0, DMA1_CH6, I2C1};
use embassy_stm32::{dma, i2c};
use embassy_time::Timer;
use panic_probe as _;
use stampfly_ina3221::{Config, EmbassyClock, Ina3221, PowerMonitor};

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
    let mut battery = Ina3221::new(bus, Ina3221::A0_GROUND, EmbassyClock, Config::default());
    loop {
        match battery.next().await {
            Ok(sample) => info!("{} V, {} A", sample.data.voltage, sample.data.current),
            Err(error) => {
                warn!("{}", error);
                Timer::after_millis(100).await;
            }
        }
    }
}
