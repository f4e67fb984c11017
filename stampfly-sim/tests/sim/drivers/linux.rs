//! I²C drivers as on Linux: a blocking bus with a start before each operation, and a delay that
//! cannot be cloned.
//!
//! `linux-embedded-hal` sends each operation as a separate message, which the kernel begins with a
//! start. A chip that receives a start between register and data takes the data for a register. At
//! the end each driver releases its bus and delay, from which another one is made.

use crate::{mounting, standing};
use embedded_hal::delay::DelayNs;
use stampfly_drivers::blocking::{Blocking, BlockingClock, block_on};
use stampfly_drivers::chip::bmi270::{self, Bmi270};
use stampfly_drivers::chip::bmm150::{self, Bmm150};
use stampfly_drivers::chip::bmp280::{self, Bmp280};
use stampfly_drivers::chip::ina3221::{self, Ina3221};
use stampfly_drivers::chip::vl53l3cx::{self, BootAddress, Vl53l3cx};
use stampfly_drivers::{Barometer, Imu, Magnetometer, PowerMonitor, RangeFinder, Timebase};
use stampfly_sim::Simulation;
use stampfly_sim::chips::{self, I2cBus, stand_in_image};
use stampfly_sim::sensors::Mount;
use stampfly_types::{Duration, Instant};

/// A delay like `linux_embedded_hal::Delay`, on virtual time.
pub struct Delay(stampfly_sim::time::Clock);

impl DelayNs for Delay {
    fn delay_ns(&mut self, ns: u32) {
        self.0.advance_to(self.0.now() + Duration::from_micros(u64::from(ns.div_ceil(1_000))));
    }
}

fn bench() -> (Simulation, I2cBus) {
    let simulation = standing();
    let bus = I2cBus::new(&simulation.clock, 1);
    bus.restart_between_operations();
    (simulation, bus)
}

pub fn clock(simulation: &Simulation) -> BlockingClock<Delay, impl Fn() -> Instant + use<>> {
    let now = simulation.clock.clone();
    BlockingClock::new(Delay(simulation.clock.clone()), move || now.now())
}

/// Takes this many samples and checks each.
pub fn delivers<E: core::fmt::Debug>(samples: usize, mut next: impl FnMut() -> Result<bool, E>) {
    for number in 0..samples {
        assert!(next().expect("a sample"), "sample {number}");
    }
}

#[test]
fn an_inertial_sensor_is_configured_and_measures() {
    let (simulation, bus) = bench();
    let image = stand_in_image();
    bus.attach(0x68, chips::Bmi270::new(&simulation.world, &simulation.clock, 1, 1.0, &image));
    let config = bmi270::Config::default();
    let mut imu = Bmi270::i2c(Blocking(bus), 0x68, clock(&simulation), &image, mounting::IMU, config);
    assert_eq!(block_on(imu.self_test()), Ok(()));
    for _ in 0..400 {
        let sample = block_on(imu.next()).expect("a sample");
        assert!((sample.data.accel.z + 9.81).abs() < 0.6, "{sample:?}");
    }
    let (bus, clock, pin) = imu.release();
    assert!(pin.is_none());
    let mut again = Bmi270::i2c(bus, 0x68, clock, &image, mounting::IMU, config);
    assert!(block_on(again.next()).is_ok());
}

#[test]
fn a_barometer_is_configured_and_measures() {
    let (simulation, bus) = bench();
    bus.attach(Bmp280::SDO_LOW, chips::Bmp280::new(&simulation.world, &simulation.clock, 1));
    let mut baro = Bmp280::i2c(Blocking(bus), Bmp280::SDO_LOW, clock(&simulation), bmp280::Config::default());
    assert_eq!(block_on(baro.self_test()), Ok(()));
    let samples = (0..20).map(|_| block_on(baro.next()).expect("a sample"));
    assert!(samples.into_iter().all(|sample| (90_000.0..110_000.0).contains(&sample.data.pressure)));
    let (bus, clock) = baro.release();
    assert!(block_on(Bmp280::i2c(bus, Bmp280::SDO_LOW, clock, bmp280::Config::default()).next()).is_ok());
}

#[test]
fn a_magnetometer_is_configured_and_measures() {
    let (simulation, bus) = bench();
    bus.attach(Bmm150::ALL_LOW, chips::Bmm150::new(&simulation.world, &simulation.clock, 1));
    let config = bmm150::Config::default();
    let mut mag = Bmm150::i2c(Blocking(bus), Bmm150::ALL_LOW, clock(&simulation), mounting::MAGNETOMETER, config);
    assert_eq!(block_on(mag.self_test()), Ok(()));
    for _ in 0..20 {
        let field = block_on(mag.next()).expect("a sample").data.field.norm();
        assert!((10.0..100.0).contains(&field), "{field} uT");
    }
    let (bus, clock) = mag.release();
    assert!(block_on(Bmm150::i2c(bus, Bmm150::ALL_LOW, clock, mounting::MAGNETOMETER, config).next()).is_ok());
}

#[test]
fn a_battery_monitor_is_configured_and_measures() {
    let (simulation, bus) = bench();
    bus.attach(Ina3221::A0_GROUND, chips::Ina3221::new(&simulation.world, &simulation.clock, 1));
    let config = ina3221::Config::default();
    let mut battery = Ina3221::new(Blocking(bus), Ina3221::A0_GROUND, clock(&simulation), config);
    assert_eq!(block_on(battery.self_test()), Ok(()));
    for _ in 0..20 {
        let sample = block_on(battery.next()).expect("a sample");
        assert!((sample.data.voltage - simulation.truth().battery_voltage).abs() < 0.03, "{sample:?}");
    }
}

#[test]
fn two_range_finders_move_and_measure() {
    let (simulation, bus) = bench();
    let (below_chip, below_pin) = chips::Vl53l3cx::new(&simulation.world, &simulation.clock, 1, Mount::Bottom);
    let (ahead_chip, ahead_pin) = chips::Vl53l3cx::new(&simulation.world, &simulation.clock, 1, Mount::Front);
    for chip in [below_chip, ahead_chip] {
        bus.attach(Vl53l3cx::BOOT_ADDRESS, chip);
    }
    let (boot, config) = (BootAddress::new(), vl53l3cx::Config::default());
    let mut below = Vl53l3cx::new(Blocking(bus.clone()), below_pin, &boot, 0x30, clock(&simulation), config);
    let mut ahead = Vl53l3cx::new(Blocking(bus), ahead_pin, &boot, 0x31, clock(&simulation), config);
    assert_eq!([block_on(below.start()), block_on(ahead.start())], [Ok(()), Ok(())]);
    for _ in 0..20 {
        let sample = block_on(below.next()).expect("a sample");
        assert!(sample.data.distance < 0.1, "it stands: {sample:?}");
    }
    let (bus, pin, clock) = ahead.release();
    let mut again = Vl53l3cx::new(bus, pin, &boot, 0x31, clock, config);
    assert!(block_on(again.next()).is_ok());
}

#[test]
fn a_time_base_that_is_lent_is_one() {
    fn now(clock: impl Timebase) -> Instant {
        clock.now()
    }
    let (simulation, _) = bench();
    let mut clock = clock(&simulation);
    assert_eq!(now(&mut clock), simulation.clock.now());
    assert_eq!(now(clock), simulation.clock.now());
}
