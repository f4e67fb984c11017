//! The StampFly's chips as they are wired: address, axes and settings of each driver.
//!
//! The same drivers run over the hardware's buses and over emulated chips; only the buses and the clock differ.
//!
//! | function | part | bus | samples per second |
//! |---|---|---|---|
//! | [`imu`] | BMI270 | SPI, mode 3, 10 MHz | 400, from 1600 |
//! | [`flow`] | PMW3901 | SPI, mode 3, 2 MHz | 100 |
//! | [`magnetometer`] | BMM150 | I2C, 0x10 | 25 |
//! | [`barometer`] | BMP280 | I2C, 0x76 | 25 |
//! | [`power`] | INA3221, channel 2, 10 mΩ | I2C, 0x40 | 13.3 |
//! | [`range_down`], [`range_ahead`] | VL53L3CX | I2C, 0x29, moved to 0x30 and 0x31 | 30 |
//!
//! The two on SPI share it in [slots](stampfly_drivers::slot): the inertial sensor leads at [`RHYTHM`], the flow sensor fits in between.

use embedded_hal::{digital::OutputPin, spi};
use embedded_hal_async::{i2c::I2c, spi::SpiDevice};
use stampfly_drivers::chip::bmi270::{self, Bmi270};
use stampfly_drivers::chip::bmm150::{self, Bmm150};
use stampfly_drivers::chip::bmp280::{self, Bmp280};
use stampfly_drivers::chip::ina3221::{self, Ina3221};
use stampfly_drivers::chip::pmw3901::{self, Pmw3901};
use stampfly_drivers::chip::vl53l3cx::{self, BootAddress, Vl53l3cx};
use stampfly_drivers::chip::{Axis, AxisMap, I2cRegisters, SpiRegisters, TransferLimit};
use stampfly_drivers::{Timebase, slot::Rhythm};
use stampfly_types::Duration;

/// How the inertial sensor is soldered, upside down: body = (y, x, −z) of the chip.
pub const IMU_AXES: AxisMap = AxisMap::new(Axis::PlusY, Axis::PlusX, Axis::MinusZ).expect("a rotation");
/// How the flow sensor is soldered: body = (−y, x) of the chip.
pub const FLOW_AXES: AxisMap = AxisMap::new(Axis::MinusY, Axis::PlusX, Axis::PlusZ).expect("a rotation");
/// How the magnetometer is soldered: body = (−y, x, z) of the chip.
pub const MAGNETOMETER_AXES: AxisMap = AxisMap::new(Axis::MinusY, Axis::PlusX, Axis::PlusZ).expect("a rotation");

/// The one mode of SPI: with two, the S3 changes the clock's level under a selected chip (espressif/esp-idf#12543).
pub const SPI_MODE: spi::Mode = spi::MODE_3;
/// Clocks on SPI, Hz: the inertial sensor's and the flow sensor's, each the fastest that the chip allows.
pub const SPI_CLOCKS: [u32; 2] = [10_000_000, 2_000_000];
/// Fewer bytes than this the processor moves itself; to set the DMA up and to be woken takes longer. The flow sensor reads twelve.
pub const SPI_DMA_FROM: usize = 16;
/// A pause in a transfer up to this is spun away: an alarm comes later than it is long.
pub const SPI_SPUN: Duration = Duration::from_micros(50);
/// The rhythm of the inertial sensor on the bus it shares.
pub const RHYTHM: Rhythm = Rhythm::HZ_400;
/// The flow sensor's longest transfer: 87 µs on the wires for twelve bytes with their pause, the rest for software.
// A longer one would give up inertial transfers: one that is out of its rhythm waits for the guest to end, and its own limit,
// 310 µs for a register, is 200 for the guest, 3 on the wires and 107 for a set-up from a cold cache.
pub const LONGEST_FLOW: Duration = Duration::from_micros(200);
const I2C: TransferLimit = TransferLimit::I2C_SENSORS;

/// The inertial sensor. `file` is Bosch's configuration of it, 8 kB.
pub fn imu<S: SpiDevice, T: Timebase>(spi: S, clock: T, file: &[u8]) -> Bmi270<'_, SpiRegisters<S>, T> {
    Bmi270::spi(spi, clock, file, IMU_AXES, bmi270::Config::default()).with_transfer_limit(TransferLimit::SPI_SENSORS)
}

/// The flow sensor.
pub fn flow<S: SpiDevice, T: Timebase>(spi: S, clock: T) -> Pmw3901<S, T> {
    Pmw3901::new(spi, clock, FLOW_AXES, pmw3901::Config::default()).with_transfer_limit(TransferLimit::SPI_GUEST)
}

/// The magnetometer.
pub fn magnetometer<I: I2c, T: Timebase>(i2c: I, clock: T) -> Bmm150<I2cRegisters<I>, T> {
    Bmm150::i2c(i2c, Bmm150::ALL_LOW, clock, MAGNETOMETER_AXES, bmm150::Config::default()).with_transfer_limit(I2C)
}

/// The barometer.
pub fn barometer<I: I2c, T: Timebase>(i2c: I, clock: T) -> Bmp280<I2cRegisters<I>, T> {
    Bmp280::i2c(i2c, Bmp280::SDO_LOW, clock, bmp280::Config::default()).with_transfer_limit(I2C)
}

/// The battery monitor.
pub fn power<I: I2c, T: Timebase>(i2c: I, clock: T) -> Ina3221<I2cRegisters<I>, T> {
    Ina3221::new(i2c, Ina3221::A0_GROUND, clock, ina3221::Config::default()).with_transfer_limit(I2C)
}

/// The range finder that looks down, at first at the floor underfoot. Create both before either is used: creating one resets it.
pub fn range_down<I: I2c, X: OutputPin, T: Timebase>(
    i2c: I,
    shutdown: X,
    boot: &BootAddress,
    clock: T,
) -> Vl53l3cx<'_, I, X, T> {
    Vl53l3cx::new(i2c, shutdown, boot, 0x30, clock, vl53l3cx::Config::automatic(true)).with_transfer_limit(I2C)
}

/// The range finder that looks ahead. On the battery hat: it answers on USB power, but cannot measure.
pub fn range_ahead<I: I2c, X: OutputPin, T: Timebase>(
    i2c: I,
    shutdown: X,
    boot: &BootAddress,
    clock: T,
) -> Vl53l3cx<'_, I, X, T> {
    Vl53l3cx::new(i2c, shutdown, boot, 0x31, clock, vl53l3cx::Config::automatic(false)).with_transfer_limit(I2C)
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::Vec3;

    #[test]
    fn a_level_vehicle_at_rest_feels_its_weight_along_body_z() {
        // The chip, upside down, sees +1 g: specific force points up, body z is down.
        assert_eq!(IMU_AXES.to_body(Vec3::new(0.0, 0.0, 9.81)), Vec3::new(0.0, 0.0, -9.81));
    }
}
