//! Outdoors: inertial sensor, satellite receiver, barometer and magnetometer on a vehicle that
//! moves far and fast, in a simulated world with seeded errors.
//!
//! | file | content |
//! |---|---|
//! | `world.rs` | the truth and its sensors |
//! | `run.rs` | an estimator in that world, and its errors |
//! | `reference.rs` | the limit set by the receiver's noise: a Kalman filter in `f64` that knows attitude and biases |
//! | others | one topic each |

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
