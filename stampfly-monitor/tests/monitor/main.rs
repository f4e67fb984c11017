//! The monitor with an estimator of fixed gains, on a vehicle that tilts back and forth.

mod body;
mod camera;
mod gyro;
mod range;
