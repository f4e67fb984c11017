#![doc = include_str!("../README.md")]
//!
//! # Modules
//! Vocabulary of the StampFly flight stack. The crates of components (estimator, controller, bus,
//! log, drivers and others) depend on this crate and not on each other, so definitions that two of
//! them share are here:
//!
//! * [`time`]: [`Instant`] and [`Duration`], the only types for time;
//! * [`frame`]: vectors, quaternions and their conventions;
//! * [`math`]: transcendental functions with the same result on every target;
//! * [`mod@message`]: the structs that travel on the bus and into the log, declared with
//!   [`message!`]; [`field`]: the types of their fields; [`schema`]: the description of their
//!   words;
//! * [`messages`]: the messages of the flight stack, from sensor to motor;
//! * [`activation`]: the record of the inputs a runnable has read, for log and replay;
//! * [`text`]: messages as text, field by field.
//!
//! # Conventions
//! SI units and radians. Body frame FRD (x forward, y right, z down), world frame NED. An attitude
//! is the quaternion that turns body vectors into world vectors. An accelerometer measures specific
//! force: level and at rest it reads (0, 0, −9.81) m/s².
//!
//! # Example
//! ```
//! use stampfly_types::{Message, Vec3, messages::ImuData};
//!
//! let sample = ImuData { accel: Vec3::new(0.0, 0.0, -9.81), gyro: Vec3::zeros(), temperature: 25.0, ..Default::default() };
//! let words = sample.to_words();
//! assert_eq!(ImuData::from_words(&words), Some(sample));
//! ```
#![no_std]

#[cfg(test)]
extern crate std;

pub mod activation;
#[cfg(feature = "math")]
mod atmosphere;
mod comparison;
pub mod field;
#[doc(hidden)]
pub mod formatted;
pub mod frame;
#[cfg(feature = "math")]
pub mod math;
pub mod message;
pub mod messages;
mod named;
#[cfg(feature = "math")]
mod origin;
pub mod schema;
#[doc(hidden)]
pub mod serial;
#[cfg(feature = "math")]
mod square_root;
pub mod stamped;
pub mod text;
pub mod time;

pub use activation::{ActivationRecord, InputRecord};
#[cfg(feature = "math")]
pub use atmosphere::pressure_altitude;
pub use field::Field;
pub use frame::{GRAVITY, Quat, Vec3};
pub use message::Message;
#[cfg(feature = "math")]
pub use origin::Origin;
pub use schema::{FieldInfo, FieldKind, Leaf, Value, leaves};
pub use stamped::Stamped;
pub use time::{Duration, Instant};
