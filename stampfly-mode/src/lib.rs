//! The judgement of a multirotor: what state it is in, whether it may arm, what is wrong, who commands, what people
//! see. Pure components, stepped with plain values.
//!
//! | module | question | output |
//! |---|---|---|
//! | [`failsafe`] | is something wrong? | `SystemAlert` |
//! | [`landing`] | does it stand or fly, has it taken off, has it landed? | `VehicleStatus` |
//! | [`authority`] | who commands? | `CommandSetpoint` |
//! | [`arming`] | may the motors turn? | `ArmBlocks` |
//! | [`machine`] | what state follows? | `SystemMode`, `EstimatorCommand` |
//! | [`calibration`] | does it stand still, and what do the sensors read then? | `CalibrationResult` |
//! | [`button`] | what did the finger do? | `ButtonEvent` |
//! | [`signal`] | what should people see and hear? | `Signal` |
//!
//! Finding and judging are kept apart: detectors only say what they see, the machine alone decides what follows, in one
//! table. Failsafe is an event there, not a state. All of it runs at the control rate, so a decision takes effect within
//! one period.
#![no_std]

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

#[cfg(test)]
extern crate std;

pub mod arming;
pub mod authority;
pub mod button;
pub mod calibration;
pub mod failsafe;
pub mod landing;
pub mod machine;
pub mod signal;

mod dated;
mod persist;

pub use authority::{Authority, AuthorityConfig, AuthorityInput};
pub use button::Button;
pub use calibration::{CalibrationConfig, StillCalibration};
pub use dated::Dated;
pub use failsafe::{Failsafe, FailsafeConfig, FailsafeInput};
pub use landing::{LandingConfig, LandingInput, LandingManager};
pub use machine::{ModeConfig, ModeInput, ModeMachine, ModeOutput};
pub use signal::Indication;
