//! A PMW3901 on an STM32F411 ("Black Pill"). Prints the motion of the image through the debug
//! probe.
//!
//! Wiring: SCK PA5, SDI PA7, SDO PA6, chip select PA4.
//!
//! Build it in `stampfly-drivers/boards/stm32`, which contains the versions of the crates and the
//! linker settings: `cargo run --release --example pmw3901`.

#![no_std]
#![no_main]

use defmt::{info, warn};
use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_stm32::bind_interrupts;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::peripherals::{DMA2_CH2, DMA2_CH3};
use embassy_stm32::time::Hertz;
use embassy_stm32::{dma, spi};
use embassy_time::{Delay, Timer};
use embedded_hal_bus::spi::ExclusiveDevice;
use panic_probe as _;
use stampfly_pmw3901::{AxisMap, Config, EmbassyClock, OpticalFlow, Pmw3901};

bind_interrupts!(struct Interrupts {
    DMA2_STREAM2 => dma::InterruptHandler<DMA2_CH2>;
    DMA2_STREAM3 => dma::InterruptHandler<DMA2_CH3>;
});

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let board = embassy_stm32::init(Default::default());
    let mut config = spi::Config::default();
    config.frequency = Hertz(2_000_000);
    config.mode = spi::MODE_3;
    let (clock, out, into) = (board.PA5, board.PA7, board.PA6);
    let bus = spi::Spi::new(board.SPI1, clock, out, into, board.DMA2_CH3, board.DMA2_CH2, Interrupts, config);
    let select = Output::new(board.PA4, Level::High, Speed::VeryHigh);
    let Ok(device) = ExclusiveDevice::new(bus, select, Delay);
    let mut flow = Pmw3901::new(device, EmbassyClock, AxisMap::IDENTITY, Config::default());
    loop {
        match flow.next().await {
            Ok(sample) => info!(
                "{} {} rad in {} s, quality {}",
                sample.data.delta_x, sample.data.delta_y, sample.data.interval, sample.data.quality
            ),
            Err(error) => {
                warn!("{}", error);
                Timer::after_millis(100).await;
            }
        }
    }
}
