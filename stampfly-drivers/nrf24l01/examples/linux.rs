//! An nRF24L01+ on a computer with Linux, such as a Raspberry Pi. Prints the packets received on
//! channel 40.
//!
//! Wiring: SPI at `/dev/spidev0.0`, CE at GPIO 22.
//!
//! Build it in `stampfly-drivers/boards/linux`, which contains the versions of the crates:
//! `cargo run --example nrf24l01`.

use linux_embedded_hal::gpio_cdev::{Chip, LineRequestFlags};
use linux_embedded_hal::spidev::{SpiModeFlags, SpidevOptions};
use linux_embedded_hal::{CdevPin, Delay, SpidevDevice};
use stampfly_nrf24l01::blocking::{Blocking, BlockingClock, block_on};
use stampfly_nrf24l01::{Config, Duration, Instant, Nrf24l01, Tuning};
use std::error::Error;

/// Settings of the transmitter: ten bytes at 1 Mbit/s, with a CRC of two bytes and without
/// acknowledgement.
const TUNING: Tuning = Tuning { channel: 40, address: [1, 2, 3, 4, 5] };

fn main() -> Result<(), Box<dyn Error>> {
    let start = std::time::Instant::now();
    let now = move || Instant::from_micros(start.elapsed().as_micros() as u64);
    let clock = BlockingClock::new(Delay, now);
    let mut device = SpidevDevice::open("/dev/spidev0.0")?;
    device.configure(&SpidevOptions::new().max_speed_hz(8_000_000).mode(SpiModeFlags::SPI_MODE_0).build())?;
    let line = Chip::new("/dev/gpiochip0")?.get_line(22)?;
    let enable = CdevPin::new(line.request(LineRequestFlags::OUTPUT, 0, "nrf24l01")?)?;
    let mut radio = Nrf24l01::<_, _, _, _, 10>::new(Blocking(device), enable, clock, Config::default());
    loop {
        block_on(radio.listen(TUNING))?;
        if let Some(packet) = block_on(radio.wait(now() + Duration::from_secs(1)))? {
            println!("{}: {:?}", packet.at, packet.payload);
        }
    }
}
