//! Outdoors: an inertial sensor, a satellite receiver, a barometer and a magnetometer on a vehicle that goes far and fast, in
//! simulated truth with seeded errors.
//!
//! | file | what |
//! |---|---|
//! | `world.rs` | the truth and its sensors |
//! | `run.rs` | an estimator in that world, and how well it did |
//! | `reference.rs` | what the receiver's noise allows: a Kalman filter in `f64` that knows attitude and biases |
//! | the others | one concern each |

mod airspeed;
mod extent;
mod heading;
mod horizon;
mod lockout;
mod own;
mod reference;
mod run;
mod wander;
mod world;
