#![doc = include_str!("../README.md")]
//!
//! # The parts
//! A simulated vehicle behind the same traits as a real one.
//!
//! * [`time`]: virtual time and a deterministic executor;
//! * [`Conditions`]: how worn, how far from the next specimen, over what floor and in what light;
//! * [`plant`]: the vehicle as a body with motors, a battery, the ground and the air: a quadrotor, an aeroplane, or one of your own;
//! * [`sensors`]: the chips, with their rates, noise, delays and quirks;
//! * [`chips`]: the same chips at register level behind simulated buses, with faults, for testing drivers;
//! * [`fault`]: what goes wrong in a flight, when, and for how long;
//! * [`sight`]: a person who flies by sight, for vehicles that are flown by sticks alone;
//! * [`sticks`]: files of what a person's thumbs did, or are to do;
//! * [`watched`]: how a flight looks from beside the field, and which end it was;
//! * [`ask`]: what a ground station asks of a vehicle that flies in real time;
//! * [`ground`]: the services that every vehicle has at its ports, and [`station`], who flies missions from there (feature `ground`);
//! * [`touchdown`]: where and how an aeroplane has touched down on a strip;
//! * [`vehicle`]: a whole vehicle with its flight stack, on virtual time;
//! * [`recorder`], [`inputs`]: the log of a simulated flight, and what a vehicle was given in it;
//! * [`Simulation`]: all of it from one [`SimulationConfig`].
//!
//! Everything is a value: no global, no thread, and no wall clock but in [`vehicle::Live`]. A process can hold as many vehicles as memory allows,
//! and the same seed gives the same bits, in debug and release builds and on every machine.
//!
//! The vehicle is a value that its own crate gives: [`PlantParameters`](plant::PlantParameters) of a quadrotor in X of up to a few
//! hundred grams whose motors do not brake, [`AeroplaneParameters`](plant::AeroplaneParameters) of a conventional aeroplane with one
//! electric propeller. A vehicle of another kind implements [`Body`](plant::Body) and [`Airframe`](plant::Airframe). Not for every
//! purpose: no vehicle bends, no aeroplane spins; the vibration that chips feel is the StampFly's, more or less of it.

pub mod ask;
pub mod chips;
mod conditions;
pub mod fault;
#[cfg(feature = "ground")]
pub mod ground;
pub mod inputs;
mod noise;
mod normals;
pub mod plant;
pub mod recorder;
mod rms;
pub mod sensors;
pub mod sight;
mod simulation;
mod specimen;
#[cfg(feature = "ground")]
pub mod station;
pub mod sticks;
pub mod time;
pub mod touchdown;
pub mod vehicle;
mod vibration;
pub mod watched;
mod world;

/// The vectors and rotations of a [`plant`].
pub use conditions::Conditions;
pub use nalgebra;
pub use noise::Noise;
pub use rms::Rms;
pub use simulation::{Simulation, SimulationConfig};
pub use specimen::Specimen;
/// The traits that simulated sensors and motors implement.
pub use stampfly_drivers as drivers;
/// Reads and changes the numbers of a plant by name.
pub use stampfly_param as param;
/// Messages, time, vectors: the words that signatures here are written in.
pub use stampfly_types as types;
pub use world::{Truth, World};
