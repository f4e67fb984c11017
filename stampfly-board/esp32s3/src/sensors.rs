//! The slow sensors, one after the other on one I2C bus.
//!
//! Each driver knows when its chip has something new and sleeps until then; the bus goes to whoever asks first, for one
//! transfer. All of them live in one task, so a transfer is never interrupted by another.

use crate::clock::Clock;
use crate::pins::I2cPins;
use embassy_embedded_hal::shared_bus::asynch::i2c::I2cDevice;
use embassy_futures::join::join3;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::mutex::Mutex;
use esp_hal::i2c::master::{BusTimeout, Config, I2c};
use esp_hal::peripherals::I2C0;
use esp_hal::time::Rate;
use stampfly_board::devices;
use stampfly_board::tasks::{Health, pump};
use stampfly_board::wiring;
use stampfly_drivers::{Barometer, Magnetometer, PowerMonitor};
use stampfly_types::Micros;

/// A driver that has failed is left alone for this long.
pub const RETRY: Micros = Micros::from_millis(100);

/// How each driver fares.
pub struct SensorHealth {
    pub imu: Health,
    pub flow: Health,
    pub mag: Health,
    pub baro: Health,
    pub power: Health,
}

/// How each driver fares, for whoever reports.
pub static HEALTH: SensorHealth = SensorHealth {
    imu: Health::new(),
    flow: Health::new(),
    mag: Health::new(),
    baro: Health::new(),
    power: Health::new(),
};

/// What the slow sensors need.
pub struct Parts {
    pub unit: I2C0<'static>,
    pub pins: I2cPins<'static>,
    pub mag: wiring::sensor_mag::Tx<'static>,
    pub baro: wiring::sensor_baro::Tx<'static>,
    pub power: wiring::sensor_power::Tx<'static>,
}

/// Reads them for ever.
#[embassy_executor::task]
pub async fn run(parts: Parts) {
    let Parts { unit, pins, mut mag, mut baro, mut power } = parts;
    // A chip that holds the clock low is given up by the hardware; the drivers' own limit comes later.
    let config = Config::default().with_frequency(Rate::from_khz(400)).with_timeout(BusTimeout::Maximum);
    let bus =
        I2c::new(unit, config).expect("400 kHz is possible").with_sda(pins.data).with_scl(pins.clock).into_async();
    let bus: Mutex<NoopRawMutex, _> = Mutex::new(bus);
    let mut mag_chip = devices::magnetometer(I2cDevice::new(&bus), Clock);
    let mut baro_chip = devices::barometer(I2cDevice::new(&bus), Clock);
    let mut power_chip = devices::power(I2cDevice::new(&bus), Clock);
    join3(
        pump(async || mag_chip.next().await, |at, sample| _ = mag.publish(at, sample), Clock, RETRY, &HEALTH.mag),
        pump(async || baro_chip.next().await, |at, sample| _ = baro.publish(at, sample), Clock, RETRY, &HEALTH.baro),
        pump(async || power_chip.next().await, |at, sample| _ = power.publish(at, sample), Clock, RETRY, &HEALTH.power),
    )
    .await;
}
