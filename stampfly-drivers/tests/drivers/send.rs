//! The future of a driver is `Send` when its bus, pin and clock are. The compiler checks this for
//! each driver, and one runs on another thread.
//!
//! This holds for drivers with a concrete bus. A function that takes `impl Imu` cannot require it
//! of the futures of its argument: it has to take the driver's own type, or run on the thread that
//! made the driver.

use core::convert::Infallible;
use embedded_hal::delay::DelayNs;
use embedded_hal::digital::OutputPin;
use embedded_hal::{digital, i2c, spi};
use stampfly_drivers::blocking::{Blocking, BlockingClock, block_on};
use stampfly_drivers::chip::bmi270::{self, Bmi270};
use stampfly_drivers::chip::bmm150::{self, Bmm150};
use stampfly_drivers::chip::bmp280::{self, Bmp280};
use stampfly_drivers::chip::ina3221::{self, Ina3221};
use stampfly_drivers::chip::mpu6000::{self, Mpu6000};
use stampfly_drivers::chip::nrf24l01::{self, Nrf24l01};
use stampfly_drivers::chip::pmw3901::{self, Pmw3901};
use stampfly_drivers::chip::vl53l3cx::{self, BootAddress, NoXshut, Vl53l3cx};
use stampfly_drivers::chip::{AxisMap, ChipError};
use stampfly_drivers::task::{Backoff, SensorHealth, run_sensor};
use stampfly_drivers::{Barometer, Imu, Magnetometer, OpticalFlow, PowerMonitor, RangeFinder};
use stampfly_types::Instant;

/// A bus without devices, and a clock that stands still.
struct Board;

impl i2c::ErrorType for Board {
    type Error = i2c::ErrorKind;
}
impl i2c::I2c for Board {
    fn transaction(&mut self, _: u8, _: &mut [i2c::Operation<'_>]) -> Result<(), i2c::ErrorKind> {
        Err(i2c::ErrorKind::Bus)
    }
}
impl spi::ErrorType for Board {
    type Error = spi::ErrorKind;
}
impl spi::SpiDevice for Board {
    fn transaction(&mut self, _: &mut [spi::Operation<'_, u8>]) -> Result<(), spi::ErrorKind> {
        Err(spi::ErrorKind::Other)
    }
}
impl digital::ErrorType for Board {
    type Error = Infallible;
}
impl OutputPin for Board {
    fn set_low(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
    fn set_high(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
impl DelayNs for Board {
    fn delay_ns(&mut self, _: u32) {}
}

type Clock = BlockingClock<Board, fn() -> Instant>;

fn clock() -> Clock {
    BlockingClock::new(Board, || Instant::ZERO)
}

fn sendable<F: Future + Send>(future: F) -> F {
    future
}

static BOOT: BootAddress = BootAddress::new();

#[test]
fn futures_of_every_driver_may_be_sent() {
    let bus = || Blocking(Board);
    let (axes, file) = (AxisMap::IDENTITY, [0; 8_192]);
    let mut battery = Ina3221::new(bus(), Ina3221::A0_GROUND, clock(), ina3221::Config::default());
    let mut barometer = Bmp280::i2c(bus(), Bmp280::SDO_LOW, clock(), bmp280::Config::default());
    let mut compass = Bmm150::i2c(bus(), Bmm150::ALL_LOW, clock(), axes, bmm150::Config::default());
    let mut barometer_on_spi = Bmp280::spi(bus(), clock(), bmp280::Config::default());
    let mut compass_on_spi = Bmm150::spi(bus(), clock(), axes, bmm150::Config::default());
    drop((sendable(barometer_on_spi.next()), sendable(compass_on_spi.next())));
    let mut inertial = Mpu6000::new(bus(), clock(), axes, mpu6000::Config::default());
    drop(sendable(inertial.next()));
    let mut radio = Nrf24l01::<_, _, _, _, 10>::new(bus(), Board, clock(), nrf24l01::Config::default());
    drop(sendable(radio.wait(Instant::ZERO)));
    let mut flow = Pmw3901::new(bus(), clock(), axes, pmw3901::Config::default());
    let mut on_spi = Bmi270::spi(bus(), clock(), &file, axes, bmi270::Config::default());
    let mut on_i2c = Bmi270::i2c(bus(), 0x68, clock(), &file, axes, bmi270::Config::default());
    let mut below = Vl53l3cx::new(bus(), Board, &BOOT, 0x30, clock(), vl53l3cx::Config::default());
    let mut ahead = Vl53l3cx::new(bus(), NoXshut, &BOOT, 0x31, clock(), vl53l3cx::Config::default());
    drop((sendable(battery.next()), sendable(barometer.next()), sendable(compass.next()), sendable(flow.next())));
    drop((sendable(on_spi.next()), sendable(on_i2c.next()), sendable(below.next()), sendable(ahead.next())));
    drop((sendable(battery.self_test()), sendable(barometer.self_test()), sendable(compass.self_test())));
    drop((sendable(flow.self_test()), sendable(on_spi.self_test()), sendable(below.self_test())));
}

#[test]
fn a_task_of_a_sensor_runs_on_another_thread() {
    let mut battery = Ina3221::new(Blocking(Board), Ina3221::A0_GROUND, clock(), ina3221::Config::default());
    let first = std::thread::spawn(move || block_on(sendable(async move { battery.next().await }))).join();
    assert_eq!(first.expect("no panic"), Err(ChipError::Bus(i2c::ErrorKind::Bus)));

    static HEALTH: SensorHealth = SensorHealth::new();
    let mut barometer = Bmp280::i2c(Blocking(Board), Bmp280::SDO_LOW, clock(), bmp280::Config::default());
    let task = run_sensor(async move || barometer.next().await, |_, _| {}, clock(), Backoff::SHARED, &HEALTH);
    drop(sendable(task));
}
