#![doc = include_str!("../README.md")]
//!
//! # The parts
//! A simulated quadrotor behind the same traits as a real one.
//!
//! * [`time`]: virtual time and a deterministic executor;
//! * [`plant`]: the vehicle as a body with motors, a battery, a floor and the air;
//! * [`sensors`]: the chips, with their rates, noise, delays and quirks;
//! * [`chips`]: the same chips at register level behind simulated buses, with faults, for testing drivers;
//! * [`fault`]: what goes wrong in a flight, when, and for how long;
//! * [`ask`]: what a ground station asks of a vehicle that flies in real time;
//! * [`vehicle`]: a whole vehicle with its flight stack, on virtual time;
//! * [`recorder`], [`inputs`]: the log of a simulated flight, and what a vehicle was given in it;
//! * [`Simulation`]: all of it from one [`SimulationConfig`].
//!
//! Everything is a value: no global, no thread, and no wall clock but in [`vehicle::Live`]. A process can hold as many vehicles as memory allows,
//! and the same seed gives the same bits, in debug and release builds and on every machine.
//!
//! The vehicle is a value, [`PlantParameters`](plant::PlantParameters), that its own crate gives. Not for every vehicle:
//! the plant is a quadrotor in X of up to a few hundred grams with brushed motors; the chips, and the vibration they
//! feel, are the StampFly's.

pub mod ask;
pub mod chips;
pub mod fault;
pub mod inputs;
mod noise;
mod normals;
pub mod plant;
pub mod recorder;
pub mod sensors;
mod simulation;
pub mod time;
pub mod vehicle;
mod vibration;
mod world;

pub use noise::Noise;
pub use simulation::{Simulation, SimulationConfig};
/// The traits that simulated sensors and motors implement.
pub use stampfly_drivers as drivers;
/// Messages, time, vectors: the words that signatures here are written in.
pub use stampfly_types as types;
pub use world::{Truth, World};
