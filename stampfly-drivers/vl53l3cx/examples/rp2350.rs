//! A VL53L3CX on a Raspberry Pi Pico 2. Prints the distance through the debug probe.
//!
//! Wiring: SDA GP4, SCL GP5, XSHUT GP6.
//!
//! Build it in `stampfly-drivers/boards/rp2350`, which contains the versions of the crates and the
//! linker settings: `cargo run --release --example vl53l3cx`.

#![no_std]
#![no_main]

use defmt::{info, warn};
use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_rp::bind_interrupts;
use embassy_rp::gpio::{Level, Output};
use embassy_rp::i2c;
use embassy_rp::peripherals::I2C0;
use embassy_time::Timer;
use panic_probe as _;
use stampfly_vl53l3cx::{BootAddress, Config, EmbassyClock, RangeFinder, Vl53l3cx};

bind_interrupts!(struct Interrupts {
    I2C0_IRQ => i2c::InterruptHandler<I2C0>;
});

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let board = embassy_rp::init(Default::default());
    let bus = i2c::I2c::new_async(board.I2C0, board.PIN_5, board.PIN_4, Interrupts, i2c::Config::default());
    let xshut = Output::new(board.PIN_6, Level::Low);
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
