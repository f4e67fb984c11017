//! Drivers for particular chips. Each is a re-export of a crate of its own.
//!
//! | module | part | measures | bus | implements |
//! |---|---|---|---|---|
//! | [`bmi270`] | Bosch BMI270 | acceleration and angular rate | SPI, I2C | [`Imu`](crate::Imu) |
//! | [`mpu6000`] | InvenSense MPU-6000 | acceleration and angular rate | SPI | [`Imu`](crate::Imu) |
//! | [`pmw3901`] | PixArt PMW3901 | optical flow | SPI | [`OpticalFlow`](crate::OpticalFlow) |
//! | [`bmp280`] | Bosch BMP280 | air pressure | SPI, I2C | [`Barometer`](crate::Barometer) |
//! | [`ina3221`] | TI INA3221 | battery voltage and current | I2C | [`PowerMonitor`](crate::PowerMonitor) |
//! | [`bmm150`] | Bosch BMM150 | magnetic field | SPI, I2C | [`Magnetometer`](crate::Magnetometer) |
//! | [`vl53l3cx`] | ST VL53L3CX | distance | I2C | [`RangeFinder`](crate::RangeFinder) |
//! | [`nrf24l01`] | Nordic nRF24L01+ | nothing: a radio | SPI | |
//!
//! # Structure of a driver
//! * A **codec** of registers, scales and formulas: pure functions and plain structs, each with its
//!   data sheet section.
//! * A **driver** on `embedded-hal-async` and a [`Timebase`](crate::Timebase). For a blocking bus
//!   wrap the bus in [`blocking`](crate::blocking); there is no second driver for it.
//!
//! # Guarantees of every driver
//! * Creating a driver does not touch the bus. The first `next` sets the chip up; call `start` to
//!   detect a fault earlier. (Creating a [`vl53l3cx`] driver pulls the chip's XSHUT pin low, so
//!   that the chip does not occupy the address of another one.)
//! * A transfer that takes longer than its length allows ([`TransferLimit`]) is given up with
//!   [`ChipError::BusTimeout`].
//! * A chip that makes no new sample in time is reported with [`ChipError::NoSample`], after a last
//!   check that began after the deadline. Waiting for a shared bus therefore does not count against
//!   the chip.
//! * A chip that lost its configuration (brown-out, ESD) is reported once with
//!   [`ChipError::Restarted`], and the next call sets it up again. With most chips every read shows
//!   whether the chip still holds its configuration. The reads of [`pmw3901`] and [`mpu6000`] do
//!   not, so their drivers check once a second.
//! * No conversion is delivered twice, even when a command to the chip is corrupted on the bus.
//! * A start may fail or be dropped at any point; the next one works from the state that it left.
//! * `self_test` checks that the chip measures: with the chip's own test, or else with its
//!   identification, its settings read back, and one measurement within the physical range of the
//!   part. It ends in bounded time, and `next` works after it as before. A measurement out of range
//!   is [`ChipError::SelfTest`]; other faults have their own errors. Call it on the ground only,
//!   because the driver delivers no samples meanwhile.
//!
//! # Requirements on the board
//! On I2C a register is written as one message, because Linux and some controllers send a repeated
//! start between the operations of a transaction. On SPI the chip select must stay low for a whole
//! transaction, as the contract of `SpiDevice` requires.
//!
//! On a shared SPI bus every chip select must be high before the first transfer to any chip. A chip
//! whose floating select is low drives the data line during its neighbour's transfers.
//!
//! # Recovery of the bus
//! Drivers share their bus, so they neither clock a stuck device free nor reset the peripheral. The
//! owner of the bus does that, with [`recover_i2c`](crate::recover_i2c). A driver returns
//! [`ChipError::Bus`] or [`ChipError::BusTimeout`] for one call and tries again at the next. A
//! board that gets these errors from every device of a bus recovers the bus.

pub use stampfly_driver_core::chip::{
    Axis, AxisMap, ChipError, I2cRegisters, Port, Registers, SpiRegisters, TransferLimit, Wires, bounded,
};
pub use {
    stampfly_bmi270 as bmi270, stampfly_bmm150 as bmm150, stampfly_bmp280 as bmp280, stampfly_ina3221 as ina3221,
    stampfly_mpu6000 as mpu6000, stampfly_nrf24l01 as nrf24l01, stampfly_pmw3901 as pmw3901,
    stampfly_vl53l3cx as vl53l3cx,
};
