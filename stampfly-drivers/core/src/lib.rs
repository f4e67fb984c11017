#![doc = include_str!("../README.md")]
#![no_std]
#![allow(
    async_fn_in_trait,
    reason = "a future is Send when driver and bus are; a bound here would refuse those that are not"
)]

#[cfg(test)]
extern crate std;

pub mod actuator;
pub mod blocking;
pub mod chip;
mod decimator;
#[cfg(feature = "embassy-time")]
mod embassy;
pub mod error;
mod interlock;
pub mod link;
mod recovery;
pub mod sensor;
pub mod shared;
pub mod slot;
pub mod task;
pub mod time;

pub use actuator::{MotorError, MotorOutputs, PwmMotors, ServoOutputs};
pub use decimator::Decimator;
#[cfg(feature = "embassy-time")]
pub use embassy::EmbassyClock;
pub use error::{SensorError, SensorErrorKind};
pub use interlock::{ArmToken, Interlock};
pub use link::{Button, Command, CommandLink, PinButton};
pub use recovery::{Recovery, RecoveryError, recover_i2c};
pub use sensor::{
    Airspeed, Barometer, Gnss, Imu, Magnetometer, MotionCapture, OpticalFlow, PowerMonitor, RangeFinder, Sample,
};
pub use time::Timebase;

pub use {embedded_hal, embedded_hal_async, stampfly_types};
