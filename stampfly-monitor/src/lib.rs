//! Fault detection for the sensors of a small vehicle, next to its state estimator.
//!
//! A Kalman filter rejects measurements that are far from its prediction. It does not detect a
//! sensor that drifts slowly, freezes, or is correct while another one is wrong: such a sensor
//! pulls the estimate along. A [`Monitor`] compares the samples, the residuals of the estimator and
//! its own dead reckoning, and reports which sensors are faulty. If a faulty sensor has moved the
//! estimate, it also returns a correction.
//!
//! | module | content |
//! |---|---|
//! | [`monitor`] | the list of hypotheses, and the evaluation of a step |
//! | [`hypothesis`] | the interface of a hypothesis |
//! | [`hypotheses`] | the hypotheses, one per file |
//! | [`evidence`] | the input of the hypotheses in a step, computed once |
//! | [`reckoner`] | dead reckoning by gyro and accelerometer |
//! | [`course`] | fits to the difference between camera and dead reckoning |
//! | [`altimeter`] | height and climb rate by accelerometer and barometer |
//! | [`vertical`] | ranges, and how the estimate follows them |
//! | [`config`] | the thresholds, with unit and origin |
//!
//! Use it for a vehicle with an inertial sensor and a camera for optical flow, or a range finder
//! with a barometer. Not for a satellite receiver, which states its own accuracy, and not for a
//! silent sensor, which its reader detects by the time of the last sample.
//!
//! # Timing
//! Call [`Monitor::step`] once per estimator step, after the estimate; time is an argument. The
//! crate has no clock and allocates nothing.
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
/// Re-exported because its types appear in this crate's interface.
pub use stampfly_types as types;
