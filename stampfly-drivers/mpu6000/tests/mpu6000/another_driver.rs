//! The emulated chip under an independent driver: [`mpu6000`](https://docs.rs/mpu6000), written for
//! embedded-hal 0.2.

use core::cell::RefCell;
use core::convert::Infallible;
use embedded_hal::spi::{Operation, SpiDevice};
use embedded_hal_02::blocking::delay::{DelayMs, DelayUs};
use embedded_hal_02::blocking::spi::{Transfer, Write};
use embedded_hal_02::digital::v2::OutputPin;
use mpu6000::bus::SpiBus as TheirBus;
use mpu6000::registers::{AccelerometerSensitive, GyroSensitive};
use mpu6000::{ClockSource, MPU6000, accelerometer_sensitive, gyro_sensitive};
use stampfly_sim::chips::{BusError, Mpu6000, SpiBus, SpiPort};
use stampfly_sim::time::Clock;
use stampfly_sim::{Simulation, SimulationConfig};
use stampfly_types::Duration;
use std::rc::Rc;

/// Bus, chip select and delay of embedded-hal 0.2 on the port of this project. Writes are buffered
/// until the length of the read is known.
#[derive(Clone)]
struct Old {
    port: Rc<RefCell<SpiPort<Mpu6000>>>,
    written: Rc<RefCell<Vec<u8>>>,
    clock: Clock,
}

impl Write<u8> for Old {
    type Error = BusError;
    fn write(&mut self, words: &[u8]) -> Result<(), BusError> {
        self.written.borrow_mut().extend_from_slice(words);
        Ok(())
    }
}

impl Transfer<u8> for Old {
    type Error = BusError;
    fn transfer<'w>(&mut self, words: &'w mut [u8]) -> Result<&'w [u8], BusError> {
        let written = self.written.take();
        self.port.borrow_mut().transaction(&mut [Operation::Write(&written), Operation::TransferInPlace(words)])?;
        Ok(words)
    }
}

impl OutputPin for Old {
    type Error = Infallible;
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.written.borrow_mut().clear();
        Ok(())
    }
    fn set_high(&mut self) -> Result<(), Infallible> {
        let written = self.written.take();
        if !written.is_empty() {
            self.port.borrow_mut().write(&written).expect("a transfer");
        }
        Ok(())
    }
}

impl DelayUs<u8> for Old {
    fn delay_us(&mut self, us: u8) {
        self.clock.advance_to(self.clock.now() + Duration::from_micros(u64::from(us)));
    }
}

impl DelayMs<u8> for Old {
    fn delay_ms(&mut self, ms: u8) {
        self.clock.advance_to(self.clock.now() + Duration::from_millis(u64::from(ms)));
    }
}

#[test]
fn another_driver_resets_it_wakes_it_and_measures_1_g() {
    let simulation = Simulation::new(&SimulationConfig::example());
    let clock = simulation.clock.clone();
    let (port, attached) = SpiBus::new(&clock, 1).attach(1_000_000, Mpu6000::new(&simulation.world, &clock, 1, 0.0));
    let mut old = Old { port: Rc::new(RefCell::new(port)), written: Rc::default(), clock };
    old.delay_ms(100);
    let mut imu = MPU6000::new(TheirBus::new(old.clone(), old.clone(), old.clone()));
    imu.reset(&mut old).ok().expect("a transfer");
    assert_eq!(imu.whoami().ok(), Some(0x68));
    imu.set_sleep(false).ok().expect("a transfer");
    imu.set_clock_source(ClockSource::PLLGyroZ).ok().expect("a transfer");
    imu.set_accelerometer_sensitive(accelerometer_sensitive!(+/-16g, 2048LSB/g)).ok().expect("a transfer");
    imu.set_gyro_sensitive(gyro_sensitive!(+/-2000dps, 16.4LSB/dps)).ok().expect("a transfer");
    imu.set_dlpf(2).ok().expect("a transfer");
    imu.set_sample_rate(500).ok().expect("a transfer");
    assert_eq!([0x6B, 0x1C, 0x1B, 0x1A, 0x19].map(|register| attached.peek(register)), [0x03, 0x18, 0x18, 2, 1]);
    old.delay_ms(100);
    let (accel, temperature, gyro) = imu.read_all().ok().expect("a transfer");
    assert!((f64::from(accel.0[2]) / 2048.0 - 1.0).abs() < 0.13, "{:?}", accel.0);
    assert!((f64::from(temperature.0) / 340.0 + 36.53 - 25.0).abs() < 1.0, "{:?}", temperature.0);
    assert!(gyro.0.iter().all(|rate| rate.abs() < 345), "within 20 °/s: {:?}", gyro.0);
}
