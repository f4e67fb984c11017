//! From state and set-point to motor duty, in exchangeable pieces.
#![no_std]

#[cfg(test)]
extern crate std;

pub mod altitude;
pub mod attitude;
pub mod cascade;
pub mod controller;
pub mod filter;
pub mod geometric;
pub mod guidance;
pub mod intent;
pub mod mixer;
pub mod motor;
pub mod pid;
pub mod position;
pub mod rate;
pub mod timing;

pub use cascade::{CascadeConfig, CascadeController, StickConfig};
pub use controller::{ControlInput, Controller};
pub use geometric::{GeometricConfig, GeometricController};
pub use intent::Intent;
pub use mixer::{GeometryError, Mixed, Mixer, MultirotorMixer, Rotor, Spin};
pub use motor::{MotorConfig, MotorCurve, MotorStage};
pub use pid::{Integration, Pid, PidGains};
