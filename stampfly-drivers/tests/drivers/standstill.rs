//! A time base whose clock stands still, while its delays return at once or after their time. Every
//! call must return an error.
//!
//! No deadline passes with such a clock, so a driver cannot work. It must not poll the chip without
//! end, however.

use core::cell::Cell;
use embedded_hal_async::delay::DelayNs;
use stampfly_driver_fakes::memory::{Chip, Clock, Pin};
use stampfly_drivers::blocking::block_on;
use stampfly_drivers::chip::bmi270::{self, Bmi270};
use stampfly_drivers::chip::bmm150::{self, Bmm150};
use stampfly_drivers::chip::bmp280::{self, Bmp280};
use stampfly_drivers::chip::ina3221::{self, Ina3221};
use stampfly_drivers::chip::pmw3901::{self, Pmw3901};
use stampfly_drivers::chip::vl53l3cx::{self, BootAddress, Vl53l3cx};
use stampfly_drivers::chip::{AxisMap, ChipError};
use stampfly_drivers::{Barometer, Imu, Magnetometer, OpticalFlow, PowerMonitor, RangeFinder, Timebase};
use stampfly_types::Instant;

/// Maximum number of waits in a call.
const ENOUGH: u32 = 20_000;

/// A clock that stands still. Panics after too many waits, which would be an endless loop.
#[derive(Default)]
struct Stopped(Cell<u32>);

impl DelayNs for Stopped {
    async fn delay_ns(&mut self, _: u32) {
        self.0.set(self.0.get() + 1);
        assert!(self.0.get() < ENOUGH, "it polls for ever");
    }
}

impl Timebase for Stopped {
    fn now(&self) -> Instant {
        Instant::from_secs(1)
    }
}

const STOPPED: ChipError<embedded_hal::i2c::ErrorKind> = ChipError::ClockStopped;
const BAROMETER: [u8; 24] = [
    0x70, 0x6B, 0x43, 0x67, 0x18, 0xFC, 0x7D, 0x8E, 0x43, 0xD6, 0xD0, 0x0B, 0x27, 0x0B, 0x8C, 0x00, 0xF9, 0xFF, 0x8C,
    0x3C, 0xF8, 0xC6, 0x70, 0x17,
];
const COMPASS: [u8; 21] = [0, 0, 9, 9, 9, 0, 0, 26, 26, 9, 9, 0xFB, 0x02, 0xAB, 0x60, 0x8D, 0x1B, 0, 0, 0xFD, 29];

#[test]
fn a_barometer_that_copies_or_converts_for_ever() {
    for status in [1, 8] {
        let bus = Chip::new(&[(0x88, &BAROMETER), (0xD0, &[0x58]), (0xF3, &[status]), (0xF7, &[0x65, 0x5A, 0xC0])]);
        let mut baro = Bmp280::i2c(bus, Bmp280::SDO_LOW, Stopped::default(), bmp280::Config::default());
        assert_eq!(block_on(baro.next()), Err(STOPPED), "{status}");
        assert_eq!(block_on(baro.next()), Err(STOPPED), "{status}, and again");
    }
}

#[test]
fn a_battery_monitor_without_a_result() {
    let bus = Chip::new(&[(0xFE, &[0x54, 0x49]), (0xFF, &[0x32, 0x20])]);
    let mut battery = Ina3221::new(bus, Ina3221::A0_GROUND, Stopped::default(), ina3221::Config::default());
    assert_eq!(block_on(battery.next()), Err(STOPPED));
    assert_eq!(block_on(battery.self_test()), Err(STOPPED));
}

#[test]
fn a_magnetometer_without_a_result() {
    let bus = Chip::new(&[(0x40, &[0x32]), (0x5D, &COMPASS)]);
    let config = bmm150::Config::default();
    let mut compass = Bmm150::i2c(bus, Bmm150::ALL_LOW, Stopped::default(), AxisMap::IDENTITY, config);
    assert_eq!(block_on(compass.next()), Err(STOPPED));
    assert_eq!(block_on(compass.self_test()), Err(STOPPED));
}

#[test]
fn an_inertial_sensor_that_does_not_start_or_gives_nothing() {
    for (started, samples) in [(0, 0), (1, 0)] {
        let status = [0, 0, 0, 0, 0, 0, 0, 0, 0, started, 0, 0, samples, 0];
        let bus = Chip::new(&[(0x00, &[0x24]), (0x21, &[started]), (0x18, &status)]);
        let (file, config) = ([0; 2], bmi270::Config::default());
        let mut imu = Bmi270::i2c(bus, 0x68, Stopped::default(), &file, AxisMap::IDENTITY, config);
        assert_eq!(block_on(imu.next()), Err(STOPPED));
    }
}

#[test]
fn a_range_finder_that_does_not_start_or_measure_and_one_whose_neighbour_never_moves() {
    let content: [(u16, &[u8]); 2] = [(0xDE, &[3, 232]), (0x10F, &[0xEA, 0xAA])];
    for firmware in [0, 1] {
        let bus = Chip::new(&[content[0], content[1], (0xE5, &[firmware])]);
        let boot = BootAddress::new();
        let mut range = Vl53l3cx::new(
            bus,
            vl53l3cx::NoXshut,
            &boot,
            Vl53l3cx::BOOT_ADDRESS,
            Stopped::default(),
            vl53l3cx::Config::default(),
        );
        assert_eq!(block_on(range.next()), Err(STOPPED), "firmware {firmware}");
    }
    let boot = BootAddress::new();
    let config = vl53l3cx::Config::default();
    let asleep = Clock::default();
    asleep.stop(true);
    let mut first = Vl53l3cx::new(Chip::new(&content), Pin::default(), &boot, 0x30, asleep, config);
    let mut second = Vl53l3cx::new(Chip::new(&content), Pin::default(), &boot, 0x31, Stopped::default(), config);
    let mut first = std::pin::pin!(first.start());
    let mut context = std::task::Context::from_waker(std::task::Waker::noop());
    assert!(first.as_mut().poll(&mut context).is_pending() && boot.is_taken());
    assert_eq!(block_on(second.start()), Err(STOPPED));
}

#[test]
fn a_flow_sensor_whose_samples_would_cover_no_time() {
    let device = Chip::new(&[
        (0x00, &[0x49]),
        (0x5F, &[0xB6]),
        (0x747, &[0x08]),
        (0x16, &[0x80, 0, 0, 0, 3, 0, 90, 1, 90, 9, 2, 7]),
    ]);
    let mut flow = Pmw3901::new(device, Stopped::default(), AxisMap::IDENTITY, pmw3901::Config::default());
    assert_eq!(block_on(flow.next()), Err(ChipError::ClockStopped));
}
