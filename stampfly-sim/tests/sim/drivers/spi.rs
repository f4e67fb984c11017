//! SPI drivers on a blocking bus as on Linux, and on a bus shared with a display: a kilobyte every
//! few milliseconds, at 8 or 1 MHz.
//!
//! For I²C see `linux` and `display`. Waiting for the bus is not a fault of the chip, so no driver
//! may give up because of it.

use super::Display;
use super::linux::{clock, delivers};
use crate::{mounting, standing};
use core::cell::RefCell;
use embedded_hal_async::spi::{Operation, SpiDevice};
use stampfly_drivers::blocking::{Blocking, block_on};
use stampfly_drivers::chip::bmi270::{self, Bmi270};
use stampfly_drivers::chip::bmm150::{self, Bmm150};
use stampfly_drivers::chip::bmp280::{self, Bmp280};
use stampfly_drivers::chip::pmw3901::{self, Pmw3901};
use stampfly_drivers::{Barometer, Imu, Magnetometer, OpticalFlow, SensorError, SensorErrorKind};
use stampfly_sim::Simulation;
use stampfly_sim::chips::{self, SpiBus, SpiChip, SpiPort, stand_in_image};
use stampfly_sim::time::{Clock, Tasks};
use stampfly_types::{Duration, Instant};

/// Clock allowed by each chip, Hz.
const BOSCH: u32 = 10_000_000;
const PIXART: u32 = 2_000_000;
const FRAME: [u8; 1_024] = [0x55; 1_024];
/// Time from the end of a frame to the beginning of the next.
const PAUSE: Duration = Duration::from_millis(10);
/// A frame takes 1 ms, or 8.2 ms.
const SPEEDS: [u32; 2] = [8_000_000, 1_000_000];

impl SpiChip for Display {
    const HIGHEST_CLOCK: u32 = 10_000_000;
    fn release(&mut self, _: Instant) {}
}

fn solder<C: SpiChip + 'static>(simulation: &Simulation, frequency: u32, chip: C) -> (SpiBus, SpiPort<C>) {
    let bus = SpiBus::new(&simulation.clock, 1);
    let (port, _) = bus.attach(frequency, chip);
    (bus, port)
}

fn inertial(simulation: &Simulation) -> chips::Bmi270 {
    chips::Bmi270::new(&simulation.world, &simulation.clock, 1, 1.0, &stand_in_image())
}

fn barometer(simulation: &Simulation) -> chips::Bmp280 {
    chips::Bmp280::new(&simulation.world, &simulation.clock, 1)
}

fn compass(simulation: &Simulation) -> chips::Bmm150 {
    chips::Bmm150::new(&simulation.world, &simulation.clock, 1)
}

fn flow(simulation: &Simulation) -> chips::Pmw3901 {
    chips::Pmw3901::new(&simulation.world, &simulation.clock, 1)
}

#[test]
fn blocking_every_chip_is_configured_and_measures_and_gives_its_device_back() {
    let simulation = standing();
    let image = stand_in_image();
    let (_, port) = solder(&simulation, BOSCH, inertial(&simulation));
    let mut imu = Bmi270::spi(Blocking(port), clock(&simulation), &image, mounting::IMU, bmi270::Config::default());
    assert_eq!(block_on(imu.self_test()), Ok(()));
    delivers(400, || block_on(imu.next()).map(|sample| (sample.data.accel.z + 9.81).abs() < 0.6));
    let (port, time, _) = imu.release();
    let mut again = Bmi270::spi(port, time, &image, mounting::IMU, bmi270::Config::default());
    delivers(1, || block_on(again.next()).map(|_| true));

    let (_, port) = solder(&simulation, BOSCH, barometer(&simulation));
    let mut baro = Bmp280::spi(Blocking(port), clock(&simulation), bmp280::Config::default());
    assert_eq!(block_on(baro.self_test()), Ok(()));
    delivers(20, || block_on(baro.next()).map(|sample| (90_000.0..110_000.0).contains(&sample.data.pressure)));
    let (port, time) = baro.release();
    let mut again = Bmp280::spi(port, time, bmp280::Config::default());
    delivers(1, || block_on(again.next()).map(|_| true));

    let (_, port) = solder(&simulation, BOSCH, compass(&simulation));
    let config = bmm150::Config::default();
    let mut mag = Bmm150::spi(Blocking(port), clock(&simulation), mounting::MAGNETOMETER, config);
    assert_eq!(block_on(mag.self_test()), Ok(()));
    delivers(20, || block_on(mag.next()).map(|sample| (10.0..100.0).contains(&sample.data.field.norm())));
    let (port, time) = mag.release();
    let mut again = Bmm150::spi(port, time, mounting::MAGNETOMETER, config);
    delivers(1, || block_on(again.next()).map(|_| true));

    let (_, port) = solder(&simulation, PIXART, flow(&simulation));
    let mut eye = Pmw3901::new(Blocking(port), clock(&simulation), mounting::FLOW, pmw3901::Config::default());
    assert_eq!(block_on(eye.self_test()), Ok(()));
    delivers(20, || block_on(eye.next()).map(|sample| sample.data.interval > 0.0));
    let (port, time) = eye.release();
    let mut again = Pmw3901::new(port, time, mounting::FLOW, pmw3901::Config::default());
    delivers(1, || block_on(again.next()).map(|_| true));
}

#[test]
fn both_kinds_of_wires_give_the_same_samples_of_one_chip() {
    let simulation = standing();
    let (_, port) = solder(&simulation, BOSCH, barometer(&simulation));
    let mut baro = Bmp280::spi(Blocking(port), clock(&simulation), bmp280::Config::default());
    let on_spi: Vec<_> = (0..20).map(|_| block_on(baro.next()).expect("a sample").data.pressure).collect();
    let simulation = standing();
    let bus = chips::I2cBus::new(&simulation.clock, 1);
    bus.attach(Bmp280::SDO_LOW, barometer(&simulation));
    let mut baro = Bmp280::i2c(Blocking(bus), Bmp280::SDO_LOW, clock(&simulation), bmp280::Config::default());
    for (on_i2c, on_spi) in (0..20).map(|_| block_on(baro.next()).expect("a sample").data.pressure).zip(on_spi) {
        // Conversions one millisecond apart of the same specimen with the same noise.
        assert!((on_i2c - on_spi).abs() < 2.0, "{on_i2c} {on_spi}");
    }
}

type Outcomes = RefCell<Vec<Result<Instant, SensorErrorKind>>>;

/// Runs `call` on the bus next to a display for three seconds: number of samples, and kinds of
/// errors.
fn beside_a_display<C: SpiChip + 'static>(
    frequency: u32,
    speed: u32,
    chip: impl Fn(&Simulation) -> C,
    driver: impl AsyncFn(SpiPort<C>, Clock, &Outcomes),
) -> Vec<Result<Instant, SensorErrorKind>> {
    let simulation = standing();
    let clock = simulation.clock.clone();
    let (bus, port) = solder(&simulation, frequency, chip(&simulation));
    let (mut display, _) = bus.attach(speed, Display);
    let seen = RefCell::new(Vec::new());
    let mut tasks = Tasks::new(clock.clone());
    let timer = clock.clone();
    tasks.spawn(async move {
        loop {
            display.transaction(&mut [Operation::Write(&FRAME)]).await.expect("it takes everything");
            timer.sleep_until(timer.now() + PAUSE).await;
        }
    });
    tasks.spawn(driver(port, clock.clone(), &seen));
    tasks.run_until(clock.now() + Duration::from_secs(3));
    drop(tasks);
    seen.into_inner()
}

/// Requests samples from a driver endlessly.
macro_rules! asked {
    (|$port:ident, $clock:ident| $driver:expr) => {
        async |$port, $clock: Clock, seen: &Outcomes| {
            let mut driver = $driver;
            loop {
                let outcome = driver.next().await;
                seen.borrow_mut().push(outcome.map(|sample| sample.at).map_err(|error| error.kind()));
            }
        }
    };
}

/// Checks that there are no errors, at least this many samples, and none twice.
fn all_samples(name: &str, speed: u32, seen: &[Result<Instant, SensorErrorKind>], least: usize) {
    let errors: Vec<_> = seen.iter().filter(|outcome| outcome.is_err()).collect();
    assert!(errors.is_empty(), "{name} at {speed} Hz: {} of {} fail: {:?}", errors.len(), seen.len(), errors[0]);
    assert!(seen.len() >= least, "{name} at {speed} Hz: {} samples", seen.len());
    let instants: Vec<Instant> = seen.iter().filter_map(|outcome| outcome.ok()).collect();
    assert!(instants.is_sorted_by(|before, after| before < after), "{name} at {speed} Hz: an instant comes twice");
}

#[test]
fn an_inertial_sensor_waits_and_loses_no_sample() {
    let image = stand_in_image();
    for speed in SPEEDS {
        let driver = asked!(|port, clock| Bmi270::spi(port, clock, &image, mounting::IMU, bmi270::Config::default()));
        // 400 per second, minus 0.2 s of start-up.
        all_samples("inertial sensor", speed, &beside_a_display(BOSCH, speed, inertial, driver), 1_000);
    }
}

#[test]
fn a_barometer_waits() {
    for speed in SPEEDS {
        let driver = asked!(|port, clock| Bmp280::spi(port, clock, bmp280::Config::default()));
        all_samples("barometer", speed, &beside_a_display(BOSCH, speed, barometer, driver), 60);
    }
}

#[test]
fn a_magnetometer_waits() {
    for speed in SPEEDS {
        let driver = asked!(|port, clock| Bmm150::spi(port, clock, mounting::MAGNETOMETER, bmm150::Config::default()));
        all_samples("magnetometer", speed, &beside_a_display(BOSCH, speed, compass, driver), 60);
    }
}

#[test]
fn a_flow_sensor_waits() {
    for speed in SPEEDS {
        let driver = asked!(|port, clock| Pmw3901::new(port, clock, mounting::FLOW, pmw3901::Config::default()));
        all_samples("flow sensor", speed, &beside_a_display(PIXART, speed, flow, driver), 90);
    }
}
