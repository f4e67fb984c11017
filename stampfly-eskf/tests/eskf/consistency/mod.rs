//! Consistency of the error-state Kalman filter: it recovers or reports divergence, takes no harm from bad time, stays
//! sound for hours, and tells what a stuck sensor is worth.

mod drag;
mod flight;
mod lockouts;
mod restart;
mod soak;
mod stuck;
mod timing;
