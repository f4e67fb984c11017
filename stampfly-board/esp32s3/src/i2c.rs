//! The I2C bus of the slow sensors, and how it is freed.

use crate::clock::Clock;
use crate::pins::I2cPins;
use embedded_hal_async::i2c::{ErrorType, Operation};
use esp_hal::Async;
use esp_hal::gpio::{AnyPin, DriveMode, Flex, OutputConfig, Pull};
use esp_hal::i2c::master::{BusTimeout, Config, Error, I2c};
use esp_hal::peripherals::I2C0;
use esp_hal::time::Rate;
use stampfly_drivers::shared::RecoverableI2c;
use stampfly_drivers::{Recovery, RecoveryError, recover_i2c};

/// The bus at 400 kHz.
pub struct Bus(I2c<'static, Async>);

/// A chip that holds the clock low is given up by the hardware; the drivers' own limit comes later.
fn config() -> Config {
    Config::default().with_frequency(Rate::from_khz(400)).with_timeout(BusTimeout::Maximum)
}

impl Bus {
    /// Frees the bus and starts it.
    pub async fn start(unit: I2C0<'static>, mut pins: I2cPins<'static>) -> Self {
        free(pins.reborrow()).await;
        let bus = I2c::new(unit, config()).expect("400 kHz is possible");
        Self(bus.with_sda(pins.data).with_scl(pins.clock).into_async())
    }
}

impl ErrorType for Bus {
    type Error = Error;
}

impl embedded_hal_async::i2c::I2c for Bus {
    async fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), Error> {
        embedded_hal_async::i2c::I2c::transaction(&mut self.0, address, operations).await
    }
}

impl RecoverableI2c for Bus {
    /// Resets the peripheral. A data line that is held it clocks free by itself before the next transfer, without saying
    /// so: that is never counted here.
    async fn recover(&mut self) -> Result<Recovery, RecoveryError> {
        self.0.apply_config(&config()).map_err(|_| RecoveryError::Pin)?;
        Ok(Recovery::WasFree)
    }
}

/// A chip that was interrupted by a restart of the processor may still hold the data line.
async fn free(pins: I2cPins<'_>) {
    let (mut clock, mut data) = (line(pins.clock.into()), line(pins.data.into()));
    // A bus that stays stuck shows in every driver's errors.
    let _ = recover_i2c(&mut clock, &mut data, &mut Clock).await;
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
