//! Tests of estimators, attitude filters and calibrations in one binary, because each binary would
//! link the estimators again. `cargo test -p stampfly-eskf --test eskf consistency` runs one module.

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
