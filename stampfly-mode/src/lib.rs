#![doc = include_str!("../README.md")]
//!
//! # The parts
//! What the vehicle is doing, whether it may, and who decides.
//!
//! | module | decides | steps |
//! |---|---|---|
//! | [`machine`] | flight phase, flight mode, commander: the only place where they change | 400 Hz |
//! | [`decision`] | the same as a function of state and facts | inside the machine |
//! | [`transitions`] | which event leads to which phase | inside the machine |
//! | [`arming`] | whether the motors may be armed, and if not, why | inside the machine |
//! | [`failsafe`] | what is wrong: detects, never acts | 400 Hz |
//! | [`landing`] | contact with the ground, take-off and landing | 400 Hz |
//! | [`stage`] | what comes next: modes and their stages, for any vehicle | by its user |
//! | [`authority`] | the sticks of the commander | 50 Hz |
//! | [`button`] | what a press meant | 50 Hz |
//! | [`gestures`] | arming by sticks, without a switch | by its user |
//! | [`signal`] | what people see and hear | 30 Hz |
//!
//! Detection and decision are apart: the failsafe reports conditions, the machine acts on them. All of it is plain
//! data stepped with the time as an argument.
#![no_std]

#[cfg(test)]
extern crate std;

pub mod arming;
pub mod authority;
pub mod button;
mod config;
pub mod decision;
mod facts;
pub mod failsafe;
pub mod gestures;
mod input;
pub mod landing;
mod lasting;
pub mod machine;
mod pilot;
pub mod signal;
pub mod stage;
mod state;
mod stop_button;
pub mod transitions;

pub use arming::Refusal;
pub use authority::{Authority, AuthorityConfig};
pub use button::{ButtonConfig, ButtonDecoder};
pub use config::ModeConfig;
pub use facts::{Asked, Facts};
pub use failsafe::{Failsafe, FailsafeConfig, FailsafeInput};
pub use gestures::Gestures;
pub use landing::{LandingConfig, LandingInput, TakeoffLanding};
pub use machine::{Command, ModeInput, ModeMachine, ModeOutput};
pub use pilot::{Heard, Switched};
pub use signal::Signaller;
/// Messages, time, vectors: the words that signatures here are written in.
pub use stampfly_types as types;
