//! An nRF24L01+ on a Raspberry Pi Pico 2. Prints the packets received on channel 40 through the
//! debug probe.
//!
//! Wiring: SCK GP18, SDI GP19, SDO GP16, chip select GP17, CE GP20, IRQ GP21.
//!
//! Build it in `stampfly-drivers/boards/rp2350`, which contains the versions of the crates and the
//! linker settings: `cargo run --release --example nrf24l01`.

#![no_std]
#![no_main]

use defmt::{info, warn};
use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_rp::bind_interrupts;
use embassy_rp::gpio::{Input, Level, Output, Pull};
use embassy_rp::peripherals::{DMA_CH0, DMA_CH1};
use embassy_rp::{dma, spi};
use embassy_time::{Delay, Timer};
use embedded_hal_bus::spi::ExclusiveDevice;
use panic_probe as _;
use stampfly_nrf24l01::{Config, Duration, EmbassyClock, Nrf24l01, Timebase, Tuning};

bind_interrupts!(struct Interrupts {
    DMA_IRQ_0 => dma::InterruptHandler<DMA_CH0>, dma::InterruptHandler<DMA_CH1>;
});

/// Settings of the transmitter: ten bytes at 1 Mbit/s, with a CRC of two bytes and without
/// acknowledgement.
const TUNING: Tuning = Tuning { channel: 40, address: [1, 2, 3, 4, 5] };

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let board = embassy_rp::init(Default::default());
    let mut config = spi::Config::default();
    config.frequency = 8_000_000;
    config.phase = spi::Phase::CaptureOnFirstTransition;
    config.polarity = spi::Polarity::IdleLow;
    let (clock, out, into) = (board.PIN_18, board.PIN_19, board.PIN_16);
    let bus = spi::Spi::new(board.SPI0, clock, out, into, board.DMA_CH0, board.DMA_CH1, Interrupts, config);
    let select = Output::new(board.PIN_17, Level::High);
    let Ok(device) = ExclusiveDevice::new(bus, select, Delay);
    let enable = Output::new(board.PIN_20, Level::Low);
    let radio = Nrf24l01::<_, _, _, _, 10>::new(device, enable, EmbassyClock, Config::default());
    let mut radio = radio.with_interrupt(Input::new(board.PIN_21, Pull::Up));
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
