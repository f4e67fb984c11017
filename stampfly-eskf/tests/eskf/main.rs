//! Estimators, attitude filters and calibrations. One binary, because each would link the estimators again:
//! `cargo test -p stampfly-eskf --test eskf consistency` runs one file.

mod air;
mod attitude;
mod calibration;
mod camera;
mod consistency;
mod huge_samples;
mod mahony_vectors;
mod outdoors;
mod slow_turns;
mod unseen;
mod vertical;
