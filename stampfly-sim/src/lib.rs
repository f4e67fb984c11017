#![doc = include_str!("../README.md")]
//!
//! # Modules
//!
//! | module | contents |
//! |---|---|
//! | [`Simulation`], [`World`] | a vehicle, its surroundings and its sensors from one [`SimulationConfig`] |
//! | [`Conditions`] | battery wear, spread between specimens, floor, light and air of a flight |
//! | [`time`] | virtual clock and a deterministic single-threaded executor |
//! | [`plant`] | dynamics: quadrotor, aeroplane, or your own [`Body`](plant::Body) |
//! | [`sensors`] | sensor models: rate, noise, delay, resolution, range |
//! | [`chips`] | the same sensors as register-level emulators on simulated buses, for testing drivers |
//! | [`fault`] | faults of a flight: what fails, when, and for how long |
//! | [`sticks`] | stick files: recorded or scripted stick input |
//! | [`sight`] | a model pilot who flies by sight, for vehicles that take stick input only |
//! | [`vehicle`] | a vehicle with its flight stack on virtual time |
//! | [`watched`], [`touchdown`] | assessment of a flight from the true motion |
//! | [`recorder`], [`inputs`] | log, hash and collected inputs of a flight |
//! | [`ask`] | requests of a ground station to a simulated vehicle |
//! | [`ground`], [`station`] | MAVLink, MSP and web services; a ground station that flies missions (feature `ground`) |
//!
//! # Determinism
//! Everything is a value: there is no global state and no thread, and only [`vehicle::Live`],
//! hardware in the loop and the timing of [`recorder`] read the wall clock. One process can hold as
//! many vehicles as memory allows. The same seed gives the same bits in debug and release builds
//! and on every machine.
//!
//! # Limits
//! [`PlantParameters`](plant::PlantParameters) describes a quadrotor in X of up to a few hundred
//! grams whose motors do not brake; [`AeroplaneParameters`](plant::AeroplaneParameters) a
//! conventional aeroplane with one electric propeller. For another kind of vehicle implement
//! [`Body`](plant::Body) and [`Airframe`](plant::Airframe). Airframes are rigid, aeroplanes do not
//! spin, and the vibration that the inertial sensor measures has the spectrum of the StampFly,
//! scaled.
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

pub use conditions::Conditions;
/// Linear algebra: the types in which the motion of a [`plant`] is written.
pub use nalgebra;
pub use noise::Noise;
pub use rms::Rms;
pub use simulation::{Simulation, SimulationConfig};
pub use specimen::Specimen;
/// The traits that simulated sensors and motors implement.
pub use stampfly_drivers as drivers;
/// Reads and changes the parameters of a plant by name.
pub use stampfly_param as param;
/// Messages, instants, durations and vectors used in the signatures of this crate.
pub use stampfly_types as types;
pub use world::{Truth, World};
