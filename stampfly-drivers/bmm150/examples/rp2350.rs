//! A BMM150 on a Raspberry Pi Pico 2. Prints the magnetic field along the chip's axes through the
//! debug probe.
//!
//! Wiring: SDA GP4, SCL GP5.
//!
//! Build it in `stampfly-drivers/boards/rp2350`, which contains the versions of the crates and the
//! linker settings: `cargo run --release --example bmm150`.

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
use stampfly_bmm150::{AxisMap, Bmm150, Config, EmbassyClock, Magnetometer};

bind_interrupts!(struct Interrupts {
    I2C0_IRQ => i2c::InterruptHandler<I2C0>;
});

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let board = embassy_rp::init(Default::default());
    let bus = i2c::I2c::new_async(board.I2C0, board.PIN_5, board.PIN_4, Interrupts, i2c::Config::default());
    let mut compass = Bmm150::i2c(bus, Bmm150::ALL_LOW, EmbassyClock, AxisMap::IDENTITY, Config::default());
    loop {
        match compass.next().await {
            Ok(sample) => {
                let field = sample.data.field;
                info!("{} {} {} µT", field.x, field.y, field.z);
            }
            Err(error) => {
                warn!("{}", error);
                Timer::after_millis(100).await;
            }
        }
    }
}
