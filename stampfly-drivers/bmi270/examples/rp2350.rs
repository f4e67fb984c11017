//! A BMI270 on a Raspberry Pi Pico 2. Prints acceleration and angular rate through the debug probe.
//!
//! Wiring: SCK GP18, SDI GP19, SDO GP16, chip select GP17.
//!
//! Build it in `stampfly-drivers/boards/rp2350`, which contains the versions of the crates and the
//! linker settings: `cargo run --release --example bmi270`.

#![no_std]
#![no_main]

use bmi2::config::BMI270_CONFIG_FILE;
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
use stampfly_bmi270::{AxisMap, Bmi270, Config, EmbassyClock, Imu};

bind_interrupts!(struct Interrupts {
    DMA_IRQ_0 => dma::InterruptHandler<DMA_CH0>, dma::InterruptHandler<DMA_CH1>;
});

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let board = embassy_rp::init(Default::default());
    let mut config = spi::Config::default();
    config.frequency = 10_000_000;
    config.phase = spi::Phase::CaptureOnSecondTransition;
    config.polarity = spi::Polarity::IdleHigh;
    let (clock, out, into) = (board.PIN_18, board.PIN_19, board.PIN_16);
    let bus = spi::Spi::new(board.SPI0, clock, out, into, board.DMA_CH0, board.DMA_CH1, Interrupts, config);
    let select = Output::new(board.PIN_17, Level::High);
    let Ok(device) = ExclusiveDevice::new(bus, select, Delay);
    let mut imu = Bmi270::spi(device, EmbassyClock, &BMI270_CONFIG_FILE, AxisMap::IDENTITY, Config::default());
    loop {
        match imu.next().await {
            Ok(sample) => {
                let (accel, gyro) = (sample.data.accel, sample.data.gyro);
                info!("{} {} {} m/s², {} {} {} rad/s", accel.x, accel.y, accel.z, gyro.x, gyro.y, gyro.z);
            }
            Err(error) => {
                warn!("{}", error);
                Timer::after_millis(100).await;
            }
        }
    }
}
