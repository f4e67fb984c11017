//! A PMW3901 on a Raspberry Pi Pico 2. Prints the motion of the image through the debug probe.
//!
//! Wiring: SCK GP18, SDI GP19, SDO GP16, chip select GP17.
//!
//! Build it in `stampfly-drivers/boards/rp2350`, which contains the versions of the crates and the
//! linker settings: `cargo run --release --example pmw3901`.

#![no_std]
#![no_main]

use defmt::{info, warn};
use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_rp::bind_interrupts;
use embassy_rp::gpio::{Level, Output};
use embassy_rp::peripherals::{DMA_CH0, DMA_CH1};
use embassy_rp::{dma, spi};
use embassy_time::{Delay, Timer};
use embedded_hal_bus::spi::ExclusiveDevice;
use panic_probe as _;
use stampfly_pmw3901::{AxisMap, Config, EmbassyClock, OpticalFlow, Pmw3901};

bind_interrupts!(struct Interrupts {
    DMA_IRQ_0 => dma::InterruptHandler<DMA_CH0>, dma::InterruptHandler<DMA_CH1>;
});

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let board = embassy_rp::init(Default::default());
    let mut config = spi::Config::default();
    config.frequency = 2_000_000;
    config.phase = spi::Phase::CaptureOnSecondTransition;
    config.polarity = spi::Polarity::IdleHigh;
    let (clock, out, into) = (board.PIN_18, board.PIN_19, board.PIN_16);
    let bus = spi::Spi::new(board.SPI0, clock, out, into, board.DMA_CH0, board.DMA_CH1, Interrupts, config);
    let select = Output::new(board.PIN_17, Level::High);
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
