#![doc = include_str!("../README.md")]
#![no_std]
#[cfg(test)]
extern crate std;

pub mod chip;
pub mod indicator;

pub use indicator::{Buzzer, Indicator, Lights, SetFrequency};
pub use stampfly_bmi270::Peak;
#[cfg(feature = "embassy-time")]
pub use stampfly_driver_core::EmbassyClock;
pub use stampfly_driver_core::{
    Airspeed, ArmToken, Barometer, Button, Command, CommandLink, Decimator, Gnss, Imu, Interlock, Magnetometer,
    MotionCapture, MotorError, MotorOutputs, OpticalFlow, PinButton, PowerMonitor, PwmMotors, RangeFinder, Recovery,
    RecoveryError, Sample, SensorError, SensorErrorKind, ServoOutputs, Timebase, actuator, blocking, error, link,
    recover_i2c, sensor, shared, slot, task, time,
};
pub use {
    smart_leds_trait, stampfly_driver_core::embedded_hal, stampfly_driver_core::embedded_hal_async, stampfly_types,
};
