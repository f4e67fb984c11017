//! An nRF24L01+ on an STM32F411 ("Black Pill"). Prints the packets received on channel 40 through
//! the debug probe.
//!
//! Wiring: SCK PA5, SDI PA7, SDO PA6, chip select PA4, CE PA3.
//!
//! Build it in `stampfly-drivers/boards/stm32`, which contains the versions of the crates and the
//! linker settings: `cargo run --release --example nrf24l01`.

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
use stampfly_nrf24l01::{Config, Duration, EmbassyClock, Nrf24l01, Timebase, Tuning};

bind_interrupts!(struct Interrupts {
    DMA2_STREAM2 => dma::InterruptHandler<DMA2_CH2>;
    DMA2_STREAM3 => dma::InterruptHandler<DMA2_CH3>;
});

/// Settings of the transmitter: ten bytes at 1 Mbit/s, with a CRC of two bytes and without
/// acknowledgement.
const TUNING: Tuning = Tuning { channel: 40, address: [1, 2, 3, 4, 5] };

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let board = embassy_stm32::init(Default::default());
    let mut config = spi::Config::default();
    config.frequency = Hertz(8_000_000);
    config.mode = spi::MODE_0;
    let (clock, out, into) = (board.PA5, board.PA7, board.PA6);
    let bus = spi::Spi::new(board.SPI1, clock, out, into, board.DMA2_CH3, board.DMA2_CH2, Interrupts, config);
    let select = Output::new(board.PA4, Level::High, Speed::VeryHigh);
    let Ok(device) = ExclusiveDevice::new(bus, select, Delay);
    let enable = Output::new(board.PA3, Level::Low, Speed::VeryHigh);
    let mut radio = Nrf24l01::<_, _, _, _, 10>::new(device, enable, EmbassyClock, Config::default());
    loop {
        let received = async {
            radio.listen(TUNING).await?;
            radio.wait(EmbassyClock.now() + Duration::from_secs(1)).await
        };
        match received.await {
            Ok(Some(packet)) => info!("{}", packet.payload),
            Ok(None) => {}
            Err(error) => {
                warn!("{}", error);
                Timer::after_millis(100).await;
            }
        }
    }
}
