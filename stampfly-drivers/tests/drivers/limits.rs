//! A bus that never answers: every transfer ends within the limit for its length.

use embedded_hal_async::{i2c, spi};
use stampfly_driver_fakes::closure::{Access, Clock, Fault, I2cBus, SpiBus, finish};
use stampfly_driver_fakes::memory::Pin;
use stampfly_drivers::blocking::block_on;
use stampfly_drivers::chip::bmi270::{self, Bmi270};
use stampfly_drivers::chip::bmm150::{self, Bmm150};
use stampfly_drivers::chip::bmp280::{self, Bmp280};
use stampfly_drivers::chip::ina3221::{self, Ina3221};
use stampfly_drivers::chip::mpu6000::{self, Mpu6000};
use stampfly_drivers::chip::nrf24l01::{self, Nrf24l01};
use stampfly_drivers::chip::pmw3901::{self, Pmw3901};
use stampfly_drivers::chip::vl53l3cx::{self, BootAddress, Vl53l3cx};
use stampfly_drivers::chip::{AxisMap, ChipError, TransferLimit};
use stampfly_drivers::{Barometer, Imu, Magnetometer, OpticalFlow, PowerMonitor, RangeFinder, Timebase};
use stampfly_types::Duration;

/// An I2C or SPI bus on which every transfer fails.
struct Broken {
    clock: Clock,
    fault: Fault,
}

impl i2c::ErrorType for Broken {
    type Error = Fault;
}

impl i2c::I2c for Broken {
    async fn transaction(&mut self, _: u8, _: &mut [i2c::Operation<'_>]) -> Result<(), Fault> {
        finish(&self.clock, Err(self.fault)).await
    }
}

impl spi::ErrorType for Broken {
    type Error = Fault;
}

impl spi::SpiDevice for Broken {
    async fn transaction(&mut self, _: &mut [spi::Operation<'_, u8>]) -> Result<(), Fault> {
        finish(&self.clock, Err(self.fault)).await
    }
}

fn silent(_: Access<'_>) -> Result<(), Fault> {
    Err(Fault::Hang)
}

#[test]
fn a_transfer_is_given_up_at_its_limit_and_not_before() {
    let clock = Clock::default();
    let bus = SpiBus { clock: clock.clone(), chip: silent };
    let mut imu = Bmi270::spi(bus, clock.clone(), &[0; 2], AxisMap::IDENTITY, bmi270::Config::default());
    let begun = clock.now();
    assert_eq!(block_on(imu.start()), Err(ChipError::BusTimeout));
    assert_eq!(clock.now().since(begun), TransferLimit::SPI.of(1));

    let bus = I2cBus { address: 0x76, clock: clock.clone(), chip: silent };
    let mut baro = Bmp280::i2c(bus, 0x76, clock.clone(), bmp280::Config::default());
    let begun = clock.now();
    assert_eq!(block_on(baro.start()), Err(ChipError::BusTimeout));
    assert_eq!(clock.now().since(begun), TransferLimit::I2C.of(1));
}

#[test]
fn what_the_flight_band_reads_ends_well_within_its_period() {
    let [spi, i2c] = [TransferLimit::SPI_SENSORS, TransferLimit::I2C_SENSORS];
    // One sample of both sensors, and four frames of the FIFO.
    assert!(spi.of(12) <= Duration::from_micros(350) && spi.of(52) <= Duration::from_micros(450), "{:?}", spi.of(52));
    assert!((1..=256).all(|bytes| spi.of(bytes) <= Duration::from_millis(1)), "everything a driver sends at once");
    // At 100 kHz a byte takes nine clocks; a transfer that is merely slow is not given up.
    assert!(
        (1..=256).all(|bytes| i2c.of(bytes).as_micros() >= bytes as u64 * 90 && i2c.of(bytes).as_micros() <= 35_000)
    );
    assert_eq!(spi.of(usize::MAX), Duration::from_micros(u64::MAX), "no overflow");
}

/// Calls a driver a hundred times on a bus that always fails. Returns the duration of the longest
/// call, and asserts that all failed.
macro_rules! worst {
    ($clock:ident, $driver:expr) => {{
        let mut driver = $driver;
        let mut worst = Duration::ZERO;
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
        let boot = BootAddress::default();
        let clock = Clock::default();
        let bus = || Broken { clock: clock.clone(), fault };
        let (imu, sensors) = (bmi270::Config::default(), TransferLimit::I2C_SENSORS);
        let alone = TransferLimit::SPI_SENSORS;
        let worst = [
            worst!(
                clock,
                Bmi270::spi(bus(), clock.clone(), &[0; 2], AxisMap::IDENTITY, imu).with_transfer_limit(alone)
            ),
            worst!(clock, Bmp280::spi(bus(), clock.clone(), bmp280::Config::default()).with_transfer_limit(alone)),
            worst!(
                clock,
                Bmi270::i2c(bus(), 0x68, clock.clone(), &[0; 2], AxisMap::IDENTITY, imu).with_transfer_limit(sensors)
            ),
            worst!(
                clock,
                Bmp280::i2c(bus(), 0x76, clock.clone(), bmp280::Config::default()).with_transfer_limit(sensors)
            ),
            worst!(
                clock,
                Ina3221::new(bus(), 0x40, clock.clone(), ina3221::Config::default()).with_transfer_limit(sensors)
            ),
            worst!(
                clock,
                Bmm150::i2c(bus(), 0x10, clock.clone(), AxisMap::IDENTITY, bmm150::Config::default())
                    .with_transfer_limit(sensors)
            ),
            worst!(
                clock,
                Bmm150::spi(bus(), clock.clone(), AxisMap::IDENTITY, bmm150::Config::default())
                    .with_transfer_limit(alone)
            ),
            worst!(
                clock,
                Pmw3901::new(bus(), clock.clone(), AxisMap::IDENTITY, pmw3901::Config::default())
                    .with_transfer_limit(TransferLimit::SPI_GUEST)
            ),
            worst!(
                clock,
                Vl53l3cx::new(bus(), Pin::default(), &boot, 0x30, clock.clone(), vl53l3cx::Config::default())
                    .with_transfer_limit(sensors)
            ),
            worst!(
                clock,
                Mpu6000::new(bus(), clock.clone(), AxisMap::IDENTITY, mpu6000::Config::default())
                    .with_transfer_limit(TransferLimit::SPI_GUEST)
            ),
            {
                let radio =
                    Nrf24l01::<_, _, _, _, 10>::new(bus(), Pin::default(), clock.clone(), nrf24l01::Config::default());
                let mut radio = radio.with_transfer_limit(alone);
                let begun = clock.now();
                for _ in 0..100 {
                    assert!(block_on(radio.listen(nrf24l01::Tuning { channel: 1, address: [1; 5] })).is_err());
                }
                clock.now().since(begun)
            },
        ];
        // The flow and range sensors first wait for the start-up of their chips. The radio: a
        // hundred calls.
        let milliseconds = [1, 1, 11, 11, 11, 15, 4, 60, 125, 10, 40];
        let limits = milliseconds.map(Duration::from_millis);
        for (worst, limit) in worst.into_iter().zip(limits) {
            assert!(worst > Duration::ZERO && worst < limit, "{worst} with {fault:?}");
        }
    }
}
