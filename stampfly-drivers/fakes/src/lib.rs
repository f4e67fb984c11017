//! Chips and clocks for tests and examples of the drivers: [`closure`] for tests, [`memory`] for
//! examples.
//!
//! Not for programs, and not a model of hardware. Emulated chips are in `stampfly-sim`.

pub mod closure;
pub mod memory;
