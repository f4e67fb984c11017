//! Modes with stages: what a vehicle does, in parts that know nothing of each other.
//!
//! Three words. The *path manager* is whoever runs the vehicle, in states of its own. A *mode* is what the vehicle does from one
//! decision to the next: it takes off, it lands. A *stage* is a part of a mode: it rolls, it climbs. The path manager calls
//! [`Selector::execute`] once in a cycle and does not know which mode is current; modes hand over to each other without it.
//! Use it for whatever an aeroplane, a rover or a multicopter does one after the other. Not for conditions that hold beside
//! each other, such as faults: those are the failsafe's.
//!
//! # What is promised
//! * A stage is made by its [`enter`](Stage::enter), and is gone after its [`exit`](Stage::exit). Nothing of the last time is
//!   left, so a second landing begins as the first one did. The same holds for a mode.
//! * `enter` comes once before the first `execute`, `exit` once after the last: at a change of stage, a hand-over, a time-out,
//!   a switch, an abort. A mode is entered before its stage and left after it.
//! * A stage says in one cycle either what it demands or what comes next. Then its successor is entered and makes the demand
//!   of the same cycle, so no demand is lost, late or mixed. After more than eight hand-overs the cycle fails.
//! * Every stage has a limit of time, or says why it has none. Limits are looked at before `execute`.
//! * A stage can change to a stage of its own mode only; a mode does not name another. It says how it has ended, and the
//!   vehicle's [`HandOver`]s say what follows. The compiler refuses a table with a hole.
//!
//! Everything is a value: no heap, no singleton, no clock. A selector can be copied, compared and stored.
//!
//! ```
//! use core::convert::Infallible;
//! use stampfly_mode::stage::{Input, Limit, Mode, Selector, Stage, Step, Vehicle};
//! use stampfly_types::{Duration, Instant};
//!
//! /// A rover that sees a distance, m, and drives at a speed, m/s.
//! struct Rover;
//! impl Vehicle for Rover {
//!     type Input<'a> = f32;
//!     type Output = f32;
//! }
//!
//! #[derive(Clone, Debug, PartialEq)]
//! struct Patrol;
//! impl Mode for Patrol {
//!     type Vehicle = Rover;
//!     type Stage = PatrolStage;
//!     type End = Infallible;
//!     const FIRST: PatrolStage = PatrolStage::Forward;
//!     fn enter(_: Instant, _: &f32) -> Self {
//!         Self
//!     }
//! }
//!
//! stampfly_mode::stages! {
//!     enum PatrolStage for Patrol { Forward: Forward, Back: Back }
//!     enum PatrolMemory;
//! }
//!
//! #[derive(Clone, Debug, PartialEq)]
//! struct Forward;
//! impl Stage<Patrol> for Forward {
//!     fn enter(_: &mut Patrol, _: Instant, _: &f32) -> Self {
//!         Self
//!     }
//!     fn limit(&self, _: &Patrol) -> Limit<Patrol> {
//!         Limit::Unlimited("a long wall is no fault")
//!     }
//!     fn execute(&mut self, _: &mut Patrol, _: Instant, distance: &f32) -> Step<Patrol> {
//!         if *distance < 0.2 { Step::Stage(PatrolStage::Back) } else { Step::Stay(0.5) }
//!     }
//! }
//!
//! #[derive(Clone, Debug, PartialEq)]
//! struct Back;
//! impl Stage<Patrol> for Back {
//!     fn enter(_: &mut Patrol, _: Instant, _: &f32) -> Self {
//!         Self
//!     }
//!     fn limit(&self, _: &Patrol) -> Limit<Patrol> {
//!         Limit::Stage(Duration::from_secs(1), PatrolStage::Forward)
//!     }
//!     fn execute(&mut self, _: &mut Patrol, _: Instant, _: &f32) -> Step<Patrol> {
//!         Step::Stay(-0.2)
//!     }
//! }
//!
//! let mut rover = Selector::<Patrol>::new();
//! assert_eq!(rover.execute(Instant::from_secs(0), &1.0), Ok(0.5));
//! assert_eq!(rover.execute(Instant::from_secs(1), &0.1), Ok(-0.2), "in the cycle that saw the wall");
//! assert_eq!(rover.mode(), Some(PatrolStage::Back));
//! assert_eq!(rover.execute(Instant::from_secs(2), &1.0), Ok(0.5), "its time is over");
//! ```
//!
//! A vehicle with several modes is a mode whose stages are modes: [`Active`]. The aircraft in `stampfly-fixed-wing/src/modes` is one.

mod active;
mod macros;
mod selector;
mod traits;

pub use active::Active;
pub use selector::{Cycle, Selector};
pub use stampfly_types::{Duration, Instant};
pub use traits::{Failure, HandOver, Input, Limit, Memory, Mode, Output, Stage, Stages, Step, Vehicle};

#[cfg(test)]
mod tests;
