//! Attitude filters for bodies without a position sensor.
//!
//! | filter | use it for | not for |
//! |---|---|---|
//! | [`AttitudeFilter`] | gyro and accelerometer, optional magnetometer; unknown gyro bias; distorted fields | – |
//! | [`Mahony`] | levelling a multirotor with the least code | unknown gyro bias, long accelerations |
//!
//! Both are plain structs without a clock: time enters as the length of a step.

mod bias;
mod bookkeeping;
mod config;
mod delay;
mod estimator;
mod filter;
mod hard_iron;
mod heading;
mod low_pass;
mod magnetic;
mod mahony;
mod rotation;
mod stationary;
mod witness;

pub use config::AttitudeConfig;
pub use filter::AttitudeFilter;
pub use mahony::Mahony;
