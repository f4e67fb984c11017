//! Is the error-state Kalman filter honest? It recovers or says that it is lost, takes no harm from bad time, stays sound
//! for hours, and tells what a stuck sensor is worth.

mod flight;
mod lockouts;
mod soak;
mod stuck;
mod timing;
