//! The monitor beside an estimator with fixed gains, on a vehicle that leans to and fro.

mod body;
mod camera;
mod gyro;
mod range;
