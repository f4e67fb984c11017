<<<<<<< HEAD
//! What the vehicle is doing, whether it may, and who decides.
//!
//! | module | decides | steps |
//! |---|---|---|
//! | [`machine`] | state and flight mode: the only place where they change | 400 Hz |
//! | [`arming`] | whether the motors may be armed, and if not, why | inside the machine |
//! | [`failsafe`] | what is wrong: detects, never acts | 400 Hz |
//! | [`landing`] | contact with the ground, take-off and landing | 400 Hz |
//! | [`authority`] | whose sticks count | 50 Hz |
//! | [`calibration`] | when it was still for long enough | 400 Hz |
//! | [`button`] | what a press meant | 50 Hz |
//! | [`signal`] | what people see and hear | 30 Hz |
//!
//! Detection and decision are apart: the failsafe reports conditions, the machine acts on them. All of it is plain
//! data stepped with the time as an argument.
#![no_std]

=======
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

>>>>>>> control
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

<<<<<<< HEAD
pub use authority::{Authority, AuthorityConfig};
pub use button::ButtonDecoder;
pub use calibration::{StillCalibration, StillnessConfig};
pub use failsafe::{Failsafe, FailsafeConfig, FailsafeInput};
pub use landing::{LandingConfig, LandingInput, TakeoffLanding};
pub use machine::{Command, ModeInput, ModeMachine, ModeOutput};
pub use signal::Signaller;
=======
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
>>>>>>> control
