//! Judges the sensors of a small vehicle, beside its state estimator.
//!
//! A Kalman filter rejects a measurement that is far from what it expects. It does not see a sensor
//! that goes wrong slowly, stays at a value or is right while another one is wrong: such a sensor takes
//! the estimate with it. A [`Monitor`] looks at the samples, at how the estimator compared them, and at
//! what it reckons by itself, and says which sensor measures. Where one has misled the estimate, it
//! says by how much.
//!
//! | module | what |
//! |---|---|
//! | [`monitor`] | the list of hypotheses, and what follows from them |
//! | [`hypothesis`] | what a hypothesis is, and what it says |
//! | [`hypotheses`] | the hypotheses, one a file |
//! | [`evidence`] | what they see in a step, computed once |
//! | [`reckoner`] | attitude and velocity by gyro and accelerometer alone |
//! | [`course`] | what explains the difference between camera and reckoner |
//! | [`altimeter`] | height and climb rate by accelerometer and barometer |
//! | [`vertical`] | ranges, and how the estimate moves with them |
//! | [`config`] | every threshold, with its unit and where it comes from |
//!
//! Use it for a vehicle with an inertial sensor and a camera for optical flow, or a range finder with a
//! barometer. Not for a receiver of satellites, which judges itself by its accuracy, and not for a
//! sensor that is silent: whoever reads it sees that.
//!
//! ```
//! use stampfly_monitor::{Monitor, MonitorConfig, MonitorInput};
//! use stampfly_types::{Instant, messages::{EstimatorStatus, Finding, StateEstimate}};
//!
//! let mut monitor = Monitor::new(MonitorConfig::default());
//! let input = MonitorInput {
//!     imu: &[], flow: &[], tof: &[], baro: &[],
//!     estimate: &StateEstimate::default(), status: &EstimatorStatus::default(),
//!     stands: true, flies: false, felt: true, restarts: 0,
//! };
//! monitor.step(Instant::from_micros(2_500), &input);
//! assert_eq!(monitor.findings().flow.finding, Finding::None);
//! ```
#![no_std]

#[cfg(test)]
extern crate std;

pub mod altimeter;
pub mod config;
pub mod course;
pub mod evidence;
pub mod hypotheses;
pub mod hypothesis;
pub mod monitor;
pub mod reckoner;
pub mod vertical;
mod vibration;

pub use config::MonitorConfig;
pub use hypothesis::{Hypothesis, Opinion, Sensor};
pub use monitor::{HYPOTHESES, Monitor, MonitorInput};
/// The types of this crate's interface.
pub use stampfly_types as types;
