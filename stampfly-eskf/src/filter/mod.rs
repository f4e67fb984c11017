//! The arithmetic of an error-state Kalman filter with fifteen states, and nothing else: no sensors, no gates.
//!
//! Error states, in order: position (world), velocity (world), attitude (body, right perturbation), gyro bias,
//! accelerometer bias. The nominal state is `position`, `velocity`, a quaternion and the two biases. Equations: Solà,
//! "Quaternion kinematics for the error-state Kalman filter", arXiv:1711.02508, sections 5 and 7, for errors in the
//! body frame.
//!
//! | file | what |
//! |---|---|
//! | `lanes.rs` | three numbers in a vector register, where there is one |
//! | [`layout`] | number and places of the error states |
//! | [`state`] | nominal state, small rotations, injection of a correction |
//! | [`covariance`] | storage, propagation, update |
//! | [`vibration`] | how much the inertial signals change between samples, which adds to the process noise |
//! | [`propagation`] | inertial samples between two instants, pre-integrated: how errors move, and how to go back |
//! | [`history`] | the last tenth of a second, for measurements that are late |

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
