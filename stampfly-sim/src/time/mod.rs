//! Virtual time: a clock that only moves when told to, and an executor that tells it.
//!
//! Use [`Clock`] wherever a driver wants a [`Timebase`](stampfly_drivers::Timebase), and [`Tasks`] to run many
//! `async` tasks on it, deterministically and as fast as the machine can. [`block_on`] runs a single future, for
//! tests and examples. Not for real hardware: nothing here ever waits for the wall.

mod clock;
mod tasks;

pub use clock::{Clock, Sleep};
pub use tasks::{Tasks, block_on};
