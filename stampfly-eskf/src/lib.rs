#![doc = include_str!("../README.md")]
//!
//! # Which estimator
//!
//! | estimator | use it for | size | not for |
//! |---|---|---|---|
//! | [`Eskf`] | position and attitude from inertial sensor and aiding sensors | 6.5 kB | – |
//! | [`Complementary`] | the same where memory and time are short | 0.4 kB | aggressive flight |
//! | [`AttitudeFilter`](attitude::AttitudeFilter) | attitude only, distorted fields | 1.2 kB | position, velocity |
//! | [`Mahony`](attitude::Mahony) | levelling a multirotor | 20 bytes | unknown gyro bias, heading |
//!
//! All but the last implement [`Estimator`]. A third of the size of [`Eskf`] is the history for
//! late measurements. [`calibration`] finds the errors of the sensors before they are used: bias,
//! scale, hard and soft iron, trim, drift with temperature.
//!
//! # Conventions
//!
//! World frame NED, body frame FRD, attitude body → world. SI units: m, s, rad; magnetic fields in
//! µT, temperatures in °C. Standard deviations are one sigma. Time is an argument; no estimator
//! reads a clock. Values that are not finite are refused and never reach a state.
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
/// Re-exported because its matrices appear in signatures.
pub use nalgebra;
pub use pacer::Pacer;
/// Messages, time and vectors: the types of the signatures.
pub use stampfly_types as types;
pub use tally::Tally;
