//! Sensors and actuators as the rest of the stack sees them.
//!
//! | trait | what it is | who implements it |
//! |---|---|---|
//! | [`Imu`] [`Magnetometer`] [`Barometer`] [`RangeFinder`] [`OpticalFlow`] [`PowerMonitor`] | a stream of samples | chip drivers, the simulator |
//! | [`CommandLink`] | a stream of authenticated commands | radios, mission scripts |
//! | [`Button`] | a contact | any `embedded_hal::digital::InputPin`, through [`PinButton`] |
//! | [`MotorOutputs`] | motors | any set of `embedded_hal::pwm::SetDutyCycle`, through [`PwmMotors`] |
//! | [`Indicator`] | lights and buzzer | [`Lights`] on any `SmartLedsWrite`, [`Buzzer`] on any [`SetFrequency`] |
//! | [`Timebase`] | a clock that can also wait | boards, the simulator |
//!
//! | module or type | what it is |
//! |---|---|
//! | [`chip`] | drivers for particular chips, on any `embedded-hal-async` bus |
//! | [`blocking`] | the same drivers on a blocking bus |
//! | [`Interlock`] | no motor turns without a decision to arm |
//! | [`slot`] | two devices on one SPI bus without a lock |
//! | [`recover_i2c`] | frees a bus whose data line is held |
//! | [`shared`] | one I2C bus for several drivers, freed when a device hangs |
//! | [`task`] | the task of a sensor, with backoff after errors and counters |
//! | [`Decimator`] | from 1600 to 400 samples per second without folding |
//!
//! Reading a sensor is input and output and therefore `async`: a driver may wait for an interrupt, a bus or a
//! conversion. Writing to motors is immediate and therefore not. Everything between the two is synchronous and
//! lives in other crates.
//!
//! # Contract of every sensor trait
//! * `next` resolves when a *new* sample is there; it never returns the same conversion twice.
//! * [`Sample::at`] is the instant the data is valid for, not the instant it was read.
//! * Data is in SI units and in the body frame (see the message's documentation).
//! * An error is about one call; the next call tries again. A driver bounds the time it can hang and then says
//!   [`SensorErrorKind::Timeout`].
//! * `next` may be dropped before it resolves (cancelled); the next call starts afresh.
#![no_std]
#![allow(async_fn_in_trait, reason = "tasks run on one core; nobody needs the futures to be Send")]

#[cfg(test)]
extern crate std;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

pub mod actuator;
pub mod blocking;
pub mod chip;
mod decimator;
pub mod error;
pub mod indicator;
mod interlock;
pub mod link;
mod peak;
mod recovery;
pub mod sensor;
pub mod shared;
pub mod slot;
pub mod task;
pub mod time;

pub use actuator::{MotorError, MotorOutputs, PwmMotors};
pub use decimator::Decimator;
pub use error::{SensorError, SensorErrorKind};
pub use indicator::{Buzzer, Indicator, Lights, SetFrequency};
pub use interlock::{ArmToken, Interlock};
pub use link::{Button, Command, CommandLink, PinButton};
pub use peak::Peak;
pub use recovery::{Recovery, RecoveryError, recover_i2c};
pub use sensor::{Barometer, Imu, Magnetometer, MotionCapture, OpticalFlow, PowerMonitor, RangeFinder, Sample};
pub use time::Timebase;
