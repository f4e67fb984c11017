//! The slow sensors, one after the other on one I2C bus.
//!
//! Each driver knows when its chip has something new and sleeps until then; the bus goes to whoever asks first, for one
//! transfer. All of them live in one task, so a transfer is never interrupted by another.

use crate::clock::Clock;
use crate::pins::{I2cPins, RangePins};
use embassy_embedded_hal::shared_bus::asynch::i2c::I2cDevice;
use embassy_futures::join::join5;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::mutex::Mutex;
use esp_hal::gpio::{AnyPin, DriveMode, Flex, Level, Output, OutputConfig, Pull};
use esp_hal::i2c::master::{BusTimeout, Config, I2c};
use esp_hal::peripherals::I2C0;
use esp_hal::time::Rate;
use stampfly_board::devices;
use stampfly_board::tasks::{Health, pump};
use stampfly_board::wiring;
use stampfly_drivers::chip::vl53l3cx::BootAddress;
use stampfly_drivers::{Barometer, Magnetometer, PowerMonitor, RangeFinder, recover_i2c};
use stampfly_types::Micros;

/// A driver that has failed is left alone for this long.
pub const RETRY: Micros = Micros::from_millis(100);

/// How each driver fares.
pub struct SensorHealth {
    pub imu: Health,
    pub flow: Health,
    pub tof: Health,
    pub tof_front: Health,
    pub mag: Health,
    pub baro: Health,
    pub power: Health,
}

/// How each driver fares, for whoever reports.
pub static HEALTH: SensorHealth = SensorHealth {
    imu: Health::new(),
    flow: Health::new(),
    tof: Health::new(),
    tof_front: Health::new(),
    mag: Health::new(),
    baro: Health::new(),
    power: Health::new(),
};

/// What the slow sensors need.
pub struct Parts {
    pub unit: I2C0<'static>,
    pub pins: I2cPins<'static>,
    pub range: RangePins<'static>,
    pub tof: wiring::sensor_tof::Tx<'static>,
    pub tof_front: wiring::sensor_tof_front::Tx<'static>,
    pub mag: wiring::sensor_mag::Tx<'static>,
    pub baro: wiring::sensor_baro::Tx<'static>,
    pub power: wiring::sensor_power::Tx<'static>,
}

/// Reads them for ever.
#[embassy_executor::task]
pub async fn run(parts: Parts) {
    let Parts { unit, mut pins, range, mut tof, mut tof_front, mut mag, mut baro, mut power } = parts;
    free(pins.reborrow()).await;
    // A chip that holds the clock low is given up by the hardware; the drivers' own limit comes later.
    let config = Config::default().with_frequency(Rate::from_khz(400)).with_timeout(BusTimeout::Maximum);
    let bus =
        I2c::new(unit, config).expect("400 kHz is possible").with_sda(pins.data).with_scl(pins.clock).into_async();
    let bus: Mutex<NoopRawMutex, _> = Mutex::new(bus);
    let i2c = || I2cDevice::new(&bus);
    let asleep = |pin: AnyPin<'static>| Output::new(pin, Level::Low, OutputConfig::default());
    let boot = BootAddress::new();
    let mut down = devices::range_down(i2c(), asleep(range.bottom_enable.into()), &boot, Clock);
    let mut ahead = devices::range_ahead(i2c(), asleep(range.front_enable.into()), &boot, Clock);
    let mut mag_chip = devices::magnetometer(i2c(), Clock);
    let mut baro_chip = devices::barometer(i2c(), Clock);
    let mut power_chip = devices::power(i2c(), Clock);
    join5(
        pump(async || down.next().await, |at, sample| _ = tof.publish(at, sample), Clock, RETRY, &HEALTH.tof),
        pump(
            async || ahead.next().await,
            |at, sample| _ = tof_front.publish(at, sample),
            Clock,
            RETRY,
            &HEALTH.tof_front,
        ),
        pump(async || mag_chip.next().await, |at, sample| _ = mag.publish(at, sample), Clock, RETRY, &HEALTH.mag),
        pump(async || baro_chip.next().await, |at, sample| _ = baro.publish(at, sample), Clock, RETRY, &HEALTH.baro),
        pump(async || power_chip.next().await, |at, sample| _ = power.publish(at, sample), Clock, RETRY, &HEALTH.power),
    )
    .await;
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
