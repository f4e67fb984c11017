//! A bus that never answers: every transfer ends within the limit of its length.

mod common;

use common::{Access, Clock, Fault, I2cBus, SpiBus};
use stampfly_drivers::Timebase;
use stampfly_drivers::blocking::block_on;
use stampfly_drivers::chip::bmi270::{self, Bmi270};
use stampfly_drivers::chip::bmp280::{self, Bmp280};
use stampfly_drivers::chip::{AxisMap, ChipError, I2cRegisters, Registers, SpiRegisters, TransferLimit};
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
    assert!((1..=256).all(|bytes| i2c.of(bytes).0 >= bytes as u64 * 90 && i2c.of(bytes).0 <= 30_000));
    assert_eq!(spi.of(usize::MAX), Micros(u64::MAX), "no overflow");
}
