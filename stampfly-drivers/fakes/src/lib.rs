//! Chips and clocks for the tests and examples of the drivers: [`closure`] for tests, [`memory`] for examples.
//!
//! Not for programs: nothing here is anything like hardware. Emulated chips are in `stampfly-sim`.

pub mod closure;
pub mod memory;
