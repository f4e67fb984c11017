//! Virtual time: a clock that only an executor advances, and that executor.
//!
//! Use [`Clock`] where a driver needs a [`Timebase`](stampfly_drivers::Timebase), and [`Tasks`] to
//! run many `async` tasks on it, deterministically and as fast as the machine allows. [`block_on`]
//! runs a single future, for tests and examples. Not for hardware: nothing here waits for
//! wall-clock time.

mod clock;
mod tasks;

pub use clock::{Clock, Sleep};
pub use tasks::{Tasks, block_on};
