//! A bus that never answers: every transfer ends within the limit of its length.

mod common;

use common::{Access, Clock, Fault, I2cBus, SpiBus};
use stampfly_drivers::blocking::block_on;
use stampfly_drivers::chip::bmi270::{self, Bmi270};
use stampfly_drivers::chip::bmm150::{self, Bmm150};
use stampfly_drivers::chip::bmp280::{self, Bmp280};
use stampfly_drivers::chip::ina3221::{self, Ina3221};
use stampfly_drivers::chip::{AxisMap, ChipError, I2cRegisters, Registers, SpiRegisters, TransferLimit};
use stampfly_drivers::{Barometer, Imu, Magnetometer, PowerMonitor, Timebase};
use stampfly_types::Micros;

fn silent(_: Access<'_>) -> Result<(), Fault> {
    Err(Fault::Hang)
}

#[test]
fn a_transfer_is_given_up_at_its_limit_and_not_before() {
    let clock = Clock::new();
    let bus = SpiBus { clock: clock.clone(), chip: silent };
    let mut imu = Bmi270::spi(bus, clock.clone(), &[0; 2], AxisMap::IDENTITY, bmi270::Config::default());
    let begun = clock.now();
    assert_eq!(block_on(imu.start()), Err(ChipError::BusTimeout));
    assert_eq!(clock.now().since(begun), TransferLimit::SPI.of(1));

    let bus = I2cBus { address: 0x76, clock: clock.clone(), chip: silent };
    let mut baro = Bmp280::new(bus, 0x76, clock.clone(), bmp280::Config::default());
    let begun = clock.now();
    assert_eq!(block_on(baro.start()), Err(ChipError::BusTimeout));
    assert_eq!(clock.now().since(begun), TransferLimit::I2C.of(1));
}

#[test]
fn what_the_flight_band_reads_ends_well_within_its_period() {
    type Spi = SpiRegisters<SpiBus<fn(Access<'_>) -> Result<(), Fault>>>;
    type I2c = I2cRegisters<I2cBus<fn(Access<'_>) -> Result<(), Fault>>>;
    let [spi, i2c] = [<Spi as Registers>::LIMIT, <I2c as Registers>::LIMIT];
    // Both sensors once, and four frames of the FIFO.
    assert!(spi.of(12) <= Micros(350) && spi.of(52) <= Micros(450), "{:?}", spi.of(52));
    assert!((1..=256).all(|bytes| spi.of(bytes) <= Micros::from_millis(1)), "everything a driver sends at once");
    // At 100 kHz a byte takes nine clocks; nothing that is merely slow is given up.
    assert!((1..=256).all(|bytes| i2c.of(bytes).0 >= bytes as u64 * 90 && i2c.of(bytes).0 <= 35_000));
    assert_eq!(spi.of(usize::MAX), Micros(u64::MAX), "no overflow");
}

/// Calls a driver a hundred times on a bus that fails for ever: how long the longest call took, and that all failed.
macro_rules! worst {
    ($clock:ident, $driver:expr) => {{
        let mut driver = $driver;
        let mut worst = Micros::ZERO;
        for _ in 0..100 {
            let begun = $clock.now();
            assert!(block_on(driver.next()).is_err());
            worst = worst.max($clock.now().since(begun));
        }
        worst
    }};
}

#[test]
fn a_storm_of_refusals_and_a_bus_that_hangs_cost_bounded_time_in_every_driver() {
    for fault in [Fault::Nack, Fault::Hang] {
        let clock = Clock::new();
        let i2c = |address| I2cBus { address, clock: clock.clone(), chip: move |_: Access<'_>| Err(fault) };
        let spi = || SpiBus { clock: clock.clone(), chip: move |_: Access<'_>| Err(fault) };
        let imu = bmi270::Config::default();
        let worst = [
            worst!(clock, Bmi270::spi(spi(), clock.clone(), &[0; 2], AxisMap::IDENTITY, imu)),
            worst!(clock, Bmi270::i2c(i2c(0x68), 0x68, clock.clone(), &[0; 2], AxisMap::IDENTITY, imu)),
            worst!(clock, Bmp280::new(i2c(0x76), 0x76, clock.clone(), bmp280::Config::default())),
            worst!(clock, Ina3221::new(i2c(0x40), 0x40, clock.clone(), ina3221::Config::default())),
            worst!(clock, Bmm150::new(i2c(0x10), 0x10, clock.clone(), AxisMap::IDENTITY, bmm150::Config::default())),
        ];
        let limits = [Micros(400), Micros(11_000), Micros(11_000), Micros(11_000), Micros(15_000)];
        for (worst, limit) in worst.into_iter().zip(limits) {
            assert!(worst > Micros::ZERO && worst < limit, "{worst} with {fault:?}");
        }
    }
}
