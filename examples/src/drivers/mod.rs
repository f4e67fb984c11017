//! What the driver examples show, wherever they run.
//!
//! Each of these modules takes a bus or a pin, a clock and something to write on, talks to one driver for some seconds
//! and says what it found. Two programs call it: `examples/NAME.rs` of this package, which runs on a PC with emulated
//! chips on virtual time and compares the answer with the truth, and `stampfly-board/esp32s3/examples/NAME.rs`, which
//! runs on the StampFly.
//!
//! | module | part | what you see | what to do meanwhile |
//! |---|---|---|---|
//! | [`bmi270`] | inertial sensor | attitude, turn rate, shaking | tilt it, turn it, knock on it |
//! | [`bmm150`] | magnetometer | field and heading | turn it around once |
//! | [`bmp280`] | barometer | pressure and height | lift it |
//! | [`vl53l3cx`] | two range finders on one bus | distances as bars | hold a hand in front |
//! | [`pmw3901`] | optical flow sensor | movement of the floor | move it over a carpet |
//! | [`ina3221`] | battery monitor | voltage, current, power | switch something on |
//! | [`lights`] | chains of WS2812 | every flight state's lights | look |
//! | [`buzzer`] | passive buzzer | every tune | listen |
//! | [`button`] | button | clicks and holds | press it |
//! | [`motors`] | four brushed motors | each motor's ramp | **propellers off**, look which one turns |

pub mod bmi270;
pub mod bmm150;
pub mod bmp280;
pub mod button;
pub mod buzzer;
pub mod ina3221;
pub mod lights;
pub mod motors;
pub mod pmw3901;
pub mod show;
pub mod vl53l3cx;

use core::fmt;
use stampfly_drivers::chip::ChipError;

/// Why an example ended early; `E` is the driver's error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Failure<E> {
    /// The driver refused.
    Driver(E),
    /// What the example says could not be written.
    Output,
}

impl<E> From<fmt::Error> for Failure<E> {
    fn from(_: fmt::Error) -> Self {
        Self::Output
    }
}

impl<E> From<ChipError<E>> for Failure<ChipError<E>> {
    fn from(error: ChipError<E>) -> Self {
        Self::Driver(error)
    }
}
