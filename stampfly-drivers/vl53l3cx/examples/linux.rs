//! A VL53L3CX on a computer with Linux, such as a Raspberry Pi. Prints the distance.
//!
//! Wiring: I2C at `/dev/i2c-1`.
//!
//! Build it in `stampfly-drivers/boards/linux`, which contains the versions of the crates:
//! `cargo run --example vl53l3cx`.

use linux_embedded_hal::{Delay, I2cdev};
use stampfly_vl53l3cx::blocking::{Blocking, BlockingClock, block_on};
use stampfly_vl53l3cx::{BootAddress, Config, Instant, NoXshut, RangeFinder, Vl53l3cx};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let start = std::time::Instant::now();
    let clock = BlockingClock::new(Delay, move || Instant::from_micros(start.elapsed().as_micros() as u64));
    let bus = I2cdev::new("/dev/i2c-1")?;
    // A single sensor without XSHUT stays at the boot address.
    let boot = BootAddress::new();
    let place = Vl53l3cx::BOOT_ADDRESS;
    let mut range = Vl53l3cx::new(Blocking(bus), NoXshut, &boot, place, clock, Config::default());
    loop {
        let sample = block_on(range.next())?;
        println!("{:.3} m, status {}", sample.data.distance, sample.data.status);
    }
}
