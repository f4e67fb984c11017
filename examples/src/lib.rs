//! Small programs to copy from: `cargo run -p examples --example NAME`.
//!
//! One per crate, on a PC:
//!
//! | name | crate | shows |
//! |---|---|---|
//! | `types` | `stampfly-types` | declaring a message, its words and its schema |
//! | `bus` | `stampfly-bus` | a vehicle of two topics and two runnables |
//! | `eskf` | `stampfly-eskf` | height and climb rate from a noisy accelerometer and range finder |
//! | `calibration` | `stampfly-eskf` | what a sensor does wrong, found before it is used |
//! | `control` | `stampfly-control` | a rate loop that learns a disturbance, on a hexacopter's mixer |
//! | `mode` | `stampfly-mode` | a flight through the state table, and what refuses to arm |
//! | `log` | `stampfly-log` | writing a log and reading it back |
//! | `link` | `stampfly-link` | a vehicle that looks for a transmitter in a room full of them |
//! | `param` | `stampfly-param` | a value that survives the power cut in the middle of its change |
//! | `sim` | `stampfly-sim` | a hop on virtual time that nobody stabilises |
//!
//! A whole vehicle: `robot` in memory, `first_vehicle` in the air, `own_vehicle` on two wheels.
//!
//! One per driver, on a PC with emulated chips and on the StampFly: see [`drivers`], which is the part of them that is
//! the same on both, and the only part that knows a driver.
#![no_std]

pub mod drivers;

/// The listing of the repository's front page.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
mod front_page {}
