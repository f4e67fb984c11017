#![doc = include_str!("../README.md")]
//!
//! # The parts
//! State estimation for small vehicles.
//!
//! | estimator | use it for | size | not for |
//! |---|---|---|---|
//! | [`Eskf`] | flying and rolling on inertial sensor, flow, range, barometer, magnetometer, motion capture, satellite receiver, sensors of your own | 6.5 kB, a third of it the memory for late measurements | – |
//! | [`Complementary`] | the same where memory and time are short | 0.4 kB | aggressive flight |
//! | [`AttitudeFilter`](attitude::AttitudeFilter) | attitude without position sensors, field bent or not | 1.2 kB | position, velocity |
//! | [`Mahony`](attitude::Mahony) | the least that levels a multirotor | 20 bytes | unknown gyro bias, heading |
//!
//! [`calibration`] finds what the sensors do wrong before they are used: bias, scale, hard and soft iron, trim, drift
//! with temperature.
//!
//! All but the last implement [`Estimator`]. They need no allocation and no other crate of the family than
//! `stampfly-types`, and give the same bits on every machine.
#![no_std]

#[cfg(test)]
extern crate std;

pub mod aid;
mod air;
pub mod attitude;
pub mod calibration;
mod complementary;
mod config;
mod eskf;
mod estimator;
pub mod filter;
mod level;
mod measurements;
mod pacer;
mod tally;

pub use air::Air;
pub use complementary::{Complementary, ComplementaryConfig};
pub use config::{EskfConfig, GravityUse, MagModel, StartHeading};
pub use eskf::Eskf;
pub use estimator::{Estimator, Fusion, Refusal};
pub use level::attitude_from_specific_force;
pub use measurements::{Aiding, Measurements, feed};
/// Its matrices are in signatures here.
pub use nalgebra;
pub use pacer::Pacer;
/// Messages, time, vectors: the words that signatures here are written in.
pub use stampfly_types as types;
pub use tally::Tally;
