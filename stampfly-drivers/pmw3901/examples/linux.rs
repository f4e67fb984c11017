//! A PMW3901 on a computer with Linux, such as a Raspberry Pi. Prints the motion of the image.
//!
//! Wiring: SPI at `/dev/spidev0.0`.
//!
//! Build it in `stampfly-drivers/boards/linux`, which contains the versions of the crates:
//! `cargo run --example pmw3901`.

use linux_embedded_hal::spidev::{SpiModeFlags, SpidevOptions};
use linux_embedded_hal::{Delay, SpidevDevice};
use stampfly_pmw3901::blocking::{Blocking, BlockingClock, block_on};
use stampfly_pmw3901::{AxisMap, Config, Instant, OpticalFlow, Pmw3901};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let start = std::time::Instant::now();
    let clock = BlockingClock::new(Delay, move || Instant::from_micros(start.elapsed().as_micros() as u64));
    let mut device = SpidevDevice::open("/dev/spidev0.0")?;
    device.configure(&SpidevOptions::new().max_speed_hz(2_000_000).mode(SpiModeFlags::SPI_MODE_3).build())?;
    let mut flow = Pmw3901::new(Blocking(device), clock, AxisMap::IDENTITY, Config::default());
    loop {
        let sample = block_on(flow.next())?;
        println!(
            "{:.3} {:.3} rad in {:.3} s, quality {}",
            sample.data.delta_x, sample.data.delta_y, sample.data.interval, sample.data.quality
        );
    }
}
