//! The slow sensors, one after the other on one I2C bus.
//!
//! Each driver knows when its chip has something new and sleeps until then. Whoever wants the bus gets it for one transfer,
//! in a circle, so nobody waits for more than one transfer of every other. All of them live in one task.

use crate::clock::Clock;
use crate::i2c;
use crate::pins::{I2cPins, RangePins};
use alloc::boxed::Box;
use embassy_futures::join::join5;
use esp_hal::gpio::{AnyPin, Level, Output, OutputConfig};
use esp_hal::peripherals::I2C0;
use stampfly_board::{Corrector, devices, topics};
use stampfly_drivers::chip::vl53l3cx::BootAddress;
use stampfly_drivers::shared::SharedI2c;
use stampfly_drivers::task::{Backoff, SensorHealth, run_sensor};
use stampfly_drivers::{Barometer, Magnetometer, PowerMonitor, RangeFinder};

/// How each driver does.
pub struct Healths {
    pub imu: SensorHealth,
    pub flow: SensorHealth,
    pub tof: SensorHealth,
    pub tof_front: SensorHealth,
    pub mag: SensorHealth,
    pub baro: SensorHealth,
    pub power: SensorHealth,
}

impl Healths {
    /// No sample and no error yet.
    pub const fn new() -> Self {
        Self {
            imu: SensorHealth::new(),
            flow: SensorHealth::new(),
            tof: SensorHealth::new(),
            tof_front: SensorHealth::new(),
            mag: SensorHealth::new(),
            baro: SensorHealth::new(),
            power: SensorHealth::new(),
        }
    }

    /// Each with the name of its topic without `sensor_`.
    pub const fn all(&self) -> [(&'static str, &SensorHealth); 7] {
        let Self { imu, flow, tof, tof_front, mag, baro, power } = self;
        [
            ("imu", imu),
            ("flow", flow),
            ("tof", tof),
            ("tof_front", tof_front),
            ("mag", mag),
            ("baro", baro),
            ("power", power),
        ]
    }
}

/// What the slow sensors need.
pub struct Parts {
    pub unit: I2C0<'static>,
    pub pins: I2cPins<'static>,
    pub range: RangePins<'static>,
    pub tof: topics::TofEnds<'static>,
    pub tof_front: topics::TofFrontEnds<'static>,
    pub mag: topics::MagEnds<'static>,
    pub baro: topics::BaroEnds<'static>,
    pub power: topics::PowerEnds<'static>,
    pub health: &'static Healths,
    /// Applies what calibrations have found.
    pub corrector: Corrector,
}

/// Reads them until power-off.
#[embassy_executor::task]
pub async fn run(parts: Box<Parts>) {
    let Parts { unit, pins, range, mut tof, mut tof_front, mut mag, mut baro, mut power, health, corrector } = *parts;
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
        run_sensor(
            async || down.next().await,
            |at, sample| _ = tof.sensor_tof.publish(at, sample),
            Clock,
            Backoff::SHARED,
            &health.tof,
        ),
        run_sensor(
            async || ahead.next().await,
            |at, sample| _ = tof_front.sensor_tof_front.publish(at, sample),
            Clock,
            Backoff::SHARED,
            &health.tof_front,
        ),
        run_sensor(
            async || mag_chip.next().await,
            |at, sample| {
                let mut sample = *sample;
                corrector.mag(&mut sample);
                mag.sensor_mag.publish(at, &sample);
            },
            Clock,
            Backoff::SHARED,
            &health.mag,
        ),
        run_sensor(
            async || baro_chip.next().await,
            |at, sample| _ = baro.sensor_baro.publish(at, sample),
            Clock,
            Backoff::SHARED,
            &health.baro,
        ),
        run_sensor(
            async || power_chip.next().await,
            |at, sample| _ = power.sensor_power.publish(at, sample),
            Clock,
            Backoff::SHARED,
            &health.power,
        ),
    )
    .await;
}
