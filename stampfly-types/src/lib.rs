#![doc = include_str!("../README.md")]
//!
//! # The parts
//! The vocabulary of the StampFly flight stack.
//!
//! Every other crate of the family depends on this one and on none of its siblings, so what two crates
//! must agree on lives here and nothing else does:
//!
//! * [`time`]: [`Instant`] and [`Duration`], the only time there is;
//! * [`frame`]: vectors, quaternions and the conventions they follow;
//! * [`math`]: the one door to transcendental functions;
//! * [`mod@message`]: what can travel on the bus and into the log, declared with [`message!`]; [`field`]: of which values
//!   it is made; [`schema`]: what its words mean;
//! * [`messages`]: the messages themselves, sensor to motor;
//! * [`activation`]: the record of what a runnable read, for the log and for replay;
//! * [`text`]: a message as text, field by field.
//!
//! # Conventions
//! SI units and radians. Body frame FRD (x forward, y right, z down), world frame NED, attitude as the
//! quaternion that turns body vectors into world vectors. An accelerometer measures specific force: level
//! and still it reads (0, 0, −9.81) m/s².
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
