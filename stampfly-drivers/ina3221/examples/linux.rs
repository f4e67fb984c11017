//! An INA3221 on a computer with Linux, such as a Raspberry Pi. Prints voltage and current of one
//! channel.
//!
//! Wiring: I2C at `/dev/i2c-1`.
//!
//! Build it in `stampfly-drivers/boards/linux`, which contains the versions of the crates:
//! `cargo run --example ina3221`.

use linux_embedded_hal::{Delay, I2cdev};
use stampfly_ina3221::blocking::{Blocking, BlockingClock, block_on};
use stampfly_ina3221::{Config, Ina3221, Instant, PowerMonitor};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let start = std::time::Instant::now();
    let clock = BlockingClock::new(Delay, move || Instant::from_micros(start.elapsed().as_micros() as u64));
    let bus = I2cdev::new("/dev/i2c-1")?;
    let mut battery = Ina3221::new(Blocking(bus), Ina3221::A0_GROUND, clock, Config::default());
    loop {
        let sample = block_on(battery.next())?;
        println!("{:.3} V, {:.3} A", sample.data.voltage, sample.data.current);
    }
}
