//! Drivers for particular chips, each a crate of its own.
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
//! # How every one of them is built
//! * A **codec** of registers, scales and formulas: pure functions and plain structs, each with its data sheet section.
//! * A **driver** on `embedded-hal-async` and a [`Timebase`](crate::Timebase). A blocking bus goes through
//!   [`blocking`](crate::blocking); there is no second driver for it.
//!
//! # What every one of them promises
//! * Creating it does not touch the bus. The first `next` sets the chip up; so does `start`, for who wants to know early.
//!   (Creating a [`vl53l3cx`] driver pulls the chip's XSHUT low, so that it is not in its neighbour's way.)
//! * A transfer that takes longer than its length allows ([`TransferLimit`]) is given up ([`ChipError::BusTimeout`]),
//!   and so is a chip that makes no new sample in time ([`ChipError::NoSample`]): by the last look at it that began after that time, so that
//!   waiting for a shared bus is not the chip's.
//! * A chip that lost its configuration (brown-out, ESD) is [`ChipError::Restarted`] once, and the next call sets it up
//!   again. Every read brings back whether it still holds it; the [`pmw3901`]'s and the [`mpu6000`]'s do not, and
//!   they are asked once a second.
//! * No conversion is delivered twice, also not when a command to the chip is garbled on its way.
//! * A start may fail or be dropped at any point; the next one begins from whatever state that left.
//! * `self_test` says whether the chip measures at all: by the chip's own test, or else by its identity, its settings read
//!   back and one measurement that the part can physically give. It ends in bounded time, and `next` works after it as
//!   before. A measurement that cannot be is [`ChipError::SelfTest`]; whatever else failed has its own error. Call it on
//!   the ground: samples are missing meanwhile.
//!
//! # What they expect of the board
//! A register is written in one piece on I2C, whatever a bus does between the operations of a transaction: Linux and some controllers start
//! again there. On SPI the chip select stays low for a whole transaction, as `SpiDevice` asks.
//!
//! On a shared SPI every chip select has to be high before the first transfer to any chip: one that floats low answers
//! into its neighbour's data.
//!
//! # Recovery of the bus
//! Drivers share a bus with others, so they do not clock a stuck slave free or reset the peripheral: that is the
//! bus owner's work, with [`recover_i2c`](crate::recover_i2c). A driver reports [`ChipError::Bus`] or
//! [`ChipError::BusTimeout`] for one call and tries again at the next; a board that sees those from every device of a
//! bus recovers the bus.

pub use stampfly_driver_core::chip::{
    Axis, AxisMap, ChipError, I2cRegisters, Port, Registers, SpiRegisters, TransferLimit, Wires, bounded,
};
pub use {
    stampfly_bmi270 as bmi270, stampfly_bmm150 as bmm150, stampfly_bmp280 as bmp280, stampfly_ina3221 as ina3221,
    stampfly_mpu6000 as mpu6000, stampfly_nrf24l01 as nrf24l01, stampfly_pmw3901 as pmw3901,
    stampfly_vl53l3cx as vl53l3cx,
};
