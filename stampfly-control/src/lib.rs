#![doc = include_str!("../README.md")]
//!
//! # The parts
//! From state and set-point to motor duty, in exchangeable pieces.
//!
//! ```text
//!  commands ─► Navigator ─► Setpoint ─► Controller ─► ControlOutput ─► Mixer ─► Mixed ─► MotorStage ─► MotorOutput
//! ```
//!
//! Each arrow is a plain value and each box a plain struct that is stepped once per control period, so any of them
//! can be replaced, tested or used alone:
//!
//! * [`guidance`]: where the vehicle should be, moment by moment;
//! * [`controller`]: the socket for control laws; [`cascade`] (the default, built from [`rate`], [`attitude`],
//!   [`position`] and [`altitude`]), the same around [`indi`], and [`geometric`] fit it; [`intent`] tells all of them what the
//!   flight mode and the estimator's validity ask for;
//! * [`flip`]: turning over once, for as long as it takes in place of the controller;
//! * [`autotune`]: measuring the vehicle in flight, and the rate loop's gains that follow;
//! * [`airframe`]: the vehicle as a value, from which mixer, controllers and motor stage are configured;
//! * [`fixed_wing`]: way-points, tracks, energy and attitude of an aeroplane;
//! * [`mixer`]: force and torque to thrust per motor, for any rotor geometry, [`layout`] for the usual ones; [`surfaces`] of an aeroplane
//!   and [`drive`] for wheels;
//! * [`motor`] and [`curve`]: thrust to duty; [`esc`]: pulses for speed controllers;
//! * [`filter`], [`pid`] and [`timing`]: building blocks.
//!
//! Units are SI, the body frame is FRD, the world NED (see [`stampfly_types::frame`]). Numbers that are not finite
//! are stopped at the entrance of each piece: they select a degraded behaviour and never reach a state or an output.
#![no_std]

#[cfg(test)]
extern crate std;

pub mod airframe;
pub mod altitude;
pub mod attitude;
pub mod autotune;
pub mod cascade;
pub mod controller;
pub mod curve;
pub mod drive;
pub mod esc;
pub mod filter;
pub mod fixed_wing;
pub mod flip;
pub mod geometric;
pub mod guidance;
pub mod indi;
pub mod intent;
pub mod layout;
pub mod mixer;
pub mod motor;
pub mod pid;
pub mod position;
pub mod rate;
pub mod surfaces;
pub mod timing;

mod answer;
mod bound;
mod input;

pub use airframe::{Airframe, Rotor, Spin};
pub use autotune::Autotune;
pub use cascade::{CascadeConfig, CascadeController, StickConfig};
pub use controller::{ControlInput, Controller};
pub use curve::MotorCurve;
pub use flip::{FlipConfig, FlipController, FlipSequencer};
pub use geometric::{GeometricConfig, GeometricController};
pub use indi::{IndiConfig, IndiController};
pub use intent::Intent;
pub use mixer::{GeometryError, Mixed, Mixer, MultirotorMixer};
pub use motor::{MotorConfig, MotorStage};
/// Its complex numbers are in signatures here.
pub use nalgebra;
pub use pid::{Integration, Pid, PidGains};
/// Messages, time, vectors: the words that signatures here are written in.
pub use stampfly_types as types;
