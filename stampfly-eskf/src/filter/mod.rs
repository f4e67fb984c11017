//! Arithmetic of a fifteen-state error-state Kalman filter, without sensors and gates.
//!
//! Use it to build a filter of your own; [`Eskf`](crate::Eskf) is the complete estimator.
//!
//! Error states, in order: position (world), velocity (world), attitude (body, right perturbation),
//! gyro bias, accelerometer bias. The nominal state holds position, velocity, a quaternion and the
//! two biases. Equations: Solà, "Quaternion kinematics for the error-state Kalman filter",
//! arXiv:1711.02508, sections 5 and 7, for errors in the body frame.
//!
//! | file | content |
//! |---|---|
//! | `lanes.rs` | three numbers, in a vector register where available |
//! | [`layout`] | number and indices of the error states |
//! | [`state`] | nominal state, small rotations, injection of a correction |
//! | [`covariance`] | storage, propagation, update |
//! | [`vibration`] | sample-to-sample change of the inertial signals, added to the process noise |
//! | [`propagation`] | pre-integrated inertial samples: error propagation, and the way back in time |
//! | [`history`] | motion of the last tenth of a second, for late measurements |

pub mod covariance;
pub mod history;
mod lanes;
pub mod layout;
pub mod propagation;
pub mod state;
pub mod vibration;

pub use covariance::Covariance;
pub use history::History;
pub use layout::{ACCEL_BIAS, ATTITUDE, GYRO_BIAS, N, POSITION, VELOCITY};
pub use propagation::PropagationStep;
pub use state::NominalState;
pub use vibration::Vibration;
