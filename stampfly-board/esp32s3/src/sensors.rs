//! The slow sensors, one after the other on one I2C bus.
//!
//! Each driver knows when its chip has something new and sleeps until then. Whoever wants the bus gets it for one transfer,
//! in a circle, so nobody waits for more than one transfer of every other. All of them live in one task.

use crate::clock::Clock;
use crate::i2c;
use crate::pins::{I2cPins, RangePins};
use embassy_futures::join::join5;
use esp_hal::gpio::{AnyPin, Level, Output, OutputConfig};
use esp_hal::peripherals::I2C0;
use stampfly_board::devices;
use stampfly_board::tasks::{Health, Retry, pump};
use stampfly_board::wiring;
use stampfly_drivers::chip::vl53l3cx::BootAddress;
use stampfly_drivers::shared::SharedI2c;
use stampfly_drivers::{Barometer, Magnetometer, PowerMonitor, RangeFinder};

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
    let Parts { unit, pins, range, mut tof, mut tof_front, mut mag, mut baro, mut power } = parts;
    let mut bus = SharedI2c::new(i2c::Bus::start(unit, pins).await);
    let ([to_down, to_ahead, to_mag, to_baro, to_power], _) = bus.split();
    let asleep = |pin: AnyPin<'static>| Output::new(pin, Level::Low, OutputConfig::default());
    let boot = BootAddress::new();
    let mut down = devices::range_down(to_down, asleep(range.bottom_enable.into()), &boot, Clock);
    let mut ahead = devices::range_ahead(to_ahead, asleep(range.front_enable.into()), &boot, Clock);
    let mut mag_chip = devices::magnetometer(to_mag, Clock);
    let mut baro_chip = devices::barometer(to_baro, Clock);
    let mut power_chip = devices::power(to_power, Clock);
    join5(
        pump(async || down.next().await, |at, sample| _ = tof.publish(at, sample), Clock, Retry::PATIENT, &HEALTH.tof),
        pump(
            async || ahead.next().await,
            |at, sample| _ = tof_front.publish(at, sample),
            Clock,
            Retry::PATIENT,
            &HEALTH.tof_front,
        ),
        pump(
            async || mag_chip.next().await,
            |at, sample| _ = mag.publish(at, sample),
            Clock,
            Retry::PATIENT,
            &HEALTH.mag,
        ),
        pump(
            async || baro_chip.next().await,
            |at, sample| _ = baro.publish(at, sample),
            Clock,
            Retry::PATIENT,
            &HEALTH.baro,
        ),
        pump(
            async || power_chip.next().await,
            |at, sample| _ = power.publish(at, sample),
            Clock,
            Retry::PATIENT,
            &HEALTH.power,
        ),
    )
    .await;
}
