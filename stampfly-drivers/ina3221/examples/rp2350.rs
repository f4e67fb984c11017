//! An INA3221 on a Raspberry Pi Pico 2. Prints voltage and current of one channel through the debug
//! probe.
//!
//! Wiring: SDA GP4, SCL GP5.
//!
//! Build it in `stampfly-drivers/boards/rp2350`, which contains the versions of the crates and the
//! linker settings: `cargo run --release --example ina3221`.

#![no_std]
#![no_main]

use defmt::{info, warn};
use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_rp::bind_interrupts;
use embassy_rp::i2c;
use embassy_rp::peripherals::I2C0;
use embassy_time::Timer;
use panic_probe as _;
use stampfly_ina3221::{Config, EmbassyClock, Ina3221, PowerMonitor};

bind_interrupts!(struct Interrupts {
    I2C0_IRQ => i2c::InterruptHandler<I2C0>;
});

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let board = embassy_rp::init(Default::default());
    let bus = i2c::I2c::new_async(board.I2C0, board.PIN_5, board.PIN_4, Interrupts, i2c::Config::default());
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
