#![doc = include_str!("../README.md")]
//!
//! Two tables say it all: [`topics`], who publishes what for whom, and [`schedule`], what runs when. The rest is
//! [runnables], one a component. What the vehicle is, in numbers, is its [airframe]. `stampfly-flight` runs them: on the hardware, in simulation, in a replay.
#![no_std]

#[cfg(any(test, feature = "simulation"))]
extern crate std;

pub mod airframe;
pub mod black_box;
mod config;
pub mod console;
pub mod devices;
pub mod golden;
pub mod link;
pub mod messages;
pub mod parameters;
pub mod rules;
pub mod runnables;
pub mod schedule;
#[cfg(feature = "simulation")]
pub mod simulation;
pub mod topics;

/// Of this package: what the vehicle calls its version, on the board and in simulation.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

pub use config::{ControllerKind, EstimatorKind, VehicleConfig};
pub use stampfly_eskf::calibration::Corrector;
/// The crates that signatures here are written in.
pub use {stampfly_bus as bus, stampfly_flight as flight, stampfly_types as types};
