//! I²C drivers on a bus shared with a display: a kilobyte every few milliseconds, at 400 or 100
//! kHz.
//!
//! Waiting for the bus is not a fault of the chip, so no driver may give up because of it. An
//! SSD1306 of 128 by 64 pixels receives 1025 bytes per frame: 23 ms at 400 kHz, 92 ms at 100 kHz. A
//! BMI270 alone uses two thirds of the bus at 400 kHz, so its display is drawn four times per
//! second.

use super::Display;
use crate::{mounting, standing};
use core::cell::RefCell;
use embedded_hal_async::i2c::{I2c, Operation};
use stampfly_drivers::chip::bmi270::{self, Bmi270};
use stampfly_drivers::chip::bmm150::{self, Bmm150};
use stampfly_drivers::chip::bmp280::{self, Bmp280};
use stampfly_drivers::chip::ina3221::{self, Ina3221};
use stampfly_drivers::chip::vl53l3cx::{self, BootAddress, Vl53l3cx};
use stampfly_drivers::{Barometer, Imu, Magnetometer, PowerMonitor, RangeFinder, SensorError, SensorErrorKind};
use stampfly_sim::Simulation;
use stampfly_sim::chips::{self, I2cBus, I2cChip, stand_in_image};
use stampfly_sim::sensors::Mount;
use stampfly_sim::time::{Clock, Tasks};
use stampfly_types::{Duration, Instant};

const FRAME: [u8; 1_025] = [0x40; 1_025];
const ADDRESS: u8 = 0x3C;
/// Time from the end of a frame to the beginning of the next.
const PAUSE: Duration = Duration::from_millis(10);
/// At a quarter of the speed the display takes four times as long per byte.
const SPEEDS: [(&str, usize); 2] = [("400 kHz", 1), ("100 kHz", 4)];

impl I2cChip for Display {
    fn receive(&mut self, _: usize, _: u8, _: Instant) -> bool {
        true
    }
    fn send(&mut self, _: usize, _: Instant) -> u8 {
        0xFF
    }
}

/// Runs `call` on the bus next to a display for three seconds: number of samples, and kinds of
/// errors.
fn beside_a_display(
    attach: impl Fn(&Simulation, &I2cBus),
    (frames, pause): (usize, Duration),
    driver: impl AsyncFn(I2cBus, Clock, &RefCell<Vec<Result<(), SensorErrorKind>>>),
) -> Vec<Result<(), SensorErrorKind>> {
    let simulation = standing();
    let clock = simulation.clock.clone();
    let bus = I2cBus::new(&clock, 1);
    attach(&simulation, &bus);
    bus.attach(ADDRESS, Display);
    let seen = RefCell::new(Vec::new());
    let mut tasks = Tasks::new(clock.clone());
    let (mut display, timer) = (bus.clone(), clock.clone());
    tasks.spawn(async move {
        loop {
            let mut operations: Vec<_> = (0..frames).map(|_| Operation::Write(&FRAME)).collect();
            display.transaction(ADDRESS, &mut operations).await.expect("it takes everything");
            timer.sleep_until(timer.now() + pause).await;
        }
    });
    tasks.spawn(driver(bus, clock.clone(), &seen));
    tasks.run_until(clock.now() + Duration::from_secs(3));
    drop(tasks);
    seen.into_inner()
}

/// Requests samples from a driver endlessly.
macro_rules! asked {
    (|$bus:ident, $clock:ident| $driver:expr) => {
        async |$bus: I2cBus, $clock: Clock, seen: &RefCell<Vec<Result<(), SensorErrorKind>>>| {
            let mut driver = $driver;
            loop {
                let outcome = driver.next().await;
                seen.borrow_mut().push(outcome.map(|_| ()).map_err(|error| error.kind()));
            }
        }
    };
}

/// Checks that there are no errors and at least this many samples.
fn all_samples(name: &str, speed: &str, seen: &[Result<(), SensorErrorKind>], least: usize) {
    let errors: Vec<_> = seen.iter().filter(|outcome| outcome.is_err()).collect();
    assert!(errors.is_empty(), "{name} at {speed}: {} of {} fail: {:?}", errors.len(), seen.len(), errors[0]);
    assert!(seen.len() >= least, "{name} at {speed}: {} samples", seen.len());
}

#[test]
fn a_barometer_waits() {
    for (speed, frames) in SPEEDS {
        let attach = |simulation: &Simulation, bus: &I2cBus| {
            bus.attach(Bmp280::SDO_LOW, chips::Bmp280::new(&simulation.world, &simulation.clock, 1));
        };
        let driver = asked!(|bus, clock| Bmp280::i2c(bus, Bmp280::SDO_LOW, clock, bmp280::Config::default()));
        all_samples("barometer", speed, &beside_a_display(attach, (frames, PAUSE), driver), 5);
    }
}

#[test]
fn a_magnetometer_waits() {
    for (speed, frames) in SPEEDS {
        let attach = |simulation: &Simulation, bus: &I2cBus| {
            bus.attach(Bmm150::ALL_LOW, chips::Bmm150::new(&simulation.world, &simulation.clock, 1));
        };
        let config = bmm150::Config::default();
        let driver = asked!(|bus, clock| Bmm150::i2c(bus, Bmm150::ALL_LOW, clock, mounting::MAGNETOMETER, config));
        all_samples("magnetometer", speed, &beside_a_display(attach, (frames, PAUSE), driver), 5);
    }
}

#[test]
fn a_battery_monitor_waits() {
    for (speed, frames) in SPEEDS {
        let attach = |simulation: &Simulation, bus: &I2cBus| {
            bus.attach(Ina3221::A0_GROUND, chips::Ina3221::new(&simulation.world, &simulation.clock, 1));
        };
        let driver = asked!(|bus, clock| Ina3221::new(bus, Ina3221::A0_GROUND, clock, ina3221::Config::default()));
        all_samples("battery monitor", speed, &beside_a_display(attach, (frames, PAUSE), driver), 5);
    }
}

#[test]
fn a_range_finder_waits() {
    for (speed, frames) in SPEEDS {
        let (boot, pin) = (BootAddress::new(), RefCell::new(None));
        let attach = |simulation: &Simulation, bus: &I2cBus| {
            let (chip, shutdown) = chips::Vl53l3cx::new(&simulation.world, &simulation.clock, 1, Mount::Bottom);
            bus.attach(Vl53l3cx::BOOT_ADDRESS, chip);
            pin.replace(Some(shutdown));
        };
        let config = vl53l3cx::Config::default();
        let driver = asked!(|bus, clock| Vl53l3cx::new(bus, pin.take().expect("attached"), &boot, 0x30, clock, config));
        all_samples("range finder", speed, &beside_a_display(attach, (frames, PAUSE), driver), 5);
    }
}

#[test]
fn an_inertial_sensor_waits_and_catches_up() {
    let image = stand_in_image();
    let attach = |simulation: &Simulation, bus: &I2cBus| {
        bus.attach(0x68, chips::Bmi270::new(&simulation.world, &simulation.clock, 1, 1.0, &image));
    };
    let config = bmi270::Config::default();
    let driver = asked!(|bus, clock| Bmi270::i2c(bus, 0x68, clock, &image, mounting::IMU, config));
    let seen = beside_a_display(attach, (1, Duration::from_millis(227)), driver);
    // 400 per second, minus half a second of start-up.
    all_samples("inertial sensor", "400 kHz", &seen, 950);
}
