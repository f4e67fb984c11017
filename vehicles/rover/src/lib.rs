#![doc = include_str!("../README.md")]
//!
//! A rover made from the StampFly flight stack: the second vehicle of the family, a software-defined vehicle in the
//! architecture of AUTOSAR (software components over a runtime environment, pure models below).
//!
//! * [`topics`] and [`schedule`]: the two tables, which are the runtime environment; [`runnables`]: its components;
//! * [`models`]: engine, brake, steering, vehicle dynamics as pure functions;
//! * [`driver_input`], [`safety`], [`diag`]: the components with state or decisions;
//! * [`parameters`]: the table of parameters, in one group per component;
//! * [`messages`]: what travels on the rover's topics;
//! * [`com`]: what travels over UDP; `simulation` (a feature): the rover for `stampfly fly`, `campaign` and `serve`.
//!
//! # Frame
//! This vehicle follows its own architecture document, not the FRD/NED of the aircraft: **x forward at the start,
//! y left, yaw counter-clockwise positive** (the convention of mathematics and of ISO 8855), so a steering angle
//! δ > 0 turns left. The public logs and reference values of the document are in this frame, and a log that must be
//! compared with them is worth more than a sign in common with a quadcopter. NED is (x, −y, −yaw).
//!
//! # Emergency stop
//! It is applied in every component and again in the dynamics: engine 0, brake at its emergency deceleration, steering
//! to the centre, and the dynamics subtract a further deceleration. It is latched by [`safety`].
#![no_std]

#[cfg(feature = "simulation")]
#[macro_use]
extern crate std;

pub mod com;
pub mod diag;
pub mod driver_input;
pub mod messages;
pub mod models;
pub mod parameters;
pub mod runnables;
pub mod safety;
pub mod schedule;
#[cfg(feature = "simulation")]
pub mod simulation;
pub mod topics;

pub use parameters::Parameters;
pub use schedule::Runnables;
/// Messages, time, vectors: the words that signatures here are written in.
pub use stampfly_types as types;
