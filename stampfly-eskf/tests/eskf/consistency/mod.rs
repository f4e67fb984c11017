//! Consistency of the error-state Kalman filter: it recovers or reports divergence, tolerates wrong
//! time stamps, stays sound for hours, and bounds the effect of a frozen sensor.

mod drag;
mod flight;
mod lockouts;
mod restart;
mod soak;
mod stuck;
mod timing;
