//! The I2C bus of the slow sensors, freed and started.

use super::clock::Clock;
use super::pins::I2cPins;
use esp_hal::Async;
use esp_hal::gpio::{AnyPin, DriveMode, Flex, OutputConfig, Pull};
use esp_hal::i2c::master::{BusTimeout, Config, I2c};
use esp_hal::peripherals::I2C0;
use esp_hal::time::Rate;
use stampfly_drivers::recover_i2c;

/// What the bus is made of.
pub struct Parts {
    pub unit: I2C0<'static>,
    pub pins: I2cPins<'static>,
}

/// Frees the bus, which a chip may still hold when the last program was ended in the middle of a transfer, and starts
/// it at 400 kHz.
pub async fn start(parts: Parts) -> I2c<'static, Async> {
    let Parts { unit, mut pins } = parts;
    let free = pins.reborrow();
    let (mut clock, mut data) = (line(free.clock.into()), line(free.data.into()));
    // A bus that stays stuck shows in the driver's error.
    let _ = recover_i2c(&mut clock, &mut data, &mut Clock).await;
    let config = Config::default().with_frequency(Rate::from_khz(400)).with_timeout(BusTimeout::Maximum);
    I2c::new(unit, config).expect("400 kHz is possible").with_sda(pins.data).with_scl(pins.clock).into_async()
}

/// A line that is let go.
fn line(pin: AnyPin<'_>) -> Flex<'_> {
    let mut line = Flex::new(pin);
    line.apply_output_config(&OutputConfig::default().with_drive_mode(DriveMode::OpenDrain).with_pull(Pull::Up));
    line.set_high();
    line.set_output_enable(true);
    line.set_input_enable(true);
    line
}
