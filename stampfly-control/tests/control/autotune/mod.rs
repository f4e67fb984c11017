//! Tuning in closed loop, against vehicles that it does not know.
//!
//! `cargo test -p stampfly-control --test control autotune -- --nocapture` prints the figures.

mod found;
mod plant;
mod stops;
mod vehicle;
