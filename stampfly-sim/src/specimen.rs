//! What is wrong with the sensors of one vehicle, as nature has it: the reference for every calibration.
//!
//! Models and emulated chips draw it from the seed; nobody on the vehicle can see it. Not the noise, which is no error that could be
//! corrected.

use nalgebra::{Matrix3, Vector3};

/// Errors of the sensors, body FRD. What is measured is `matrix · true + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Specimen {
    /// Accelerometer: scale and misalignment.
    pub accel_matrix: Matrix3<f64>,
    /// Accelerometer: its place, from the centre of mass, body, m.
    pub lever: Vector3<f64>,
    /// Accelerometer: offset at the beginning and at 25 °C, m/s².
    pub accel_bias: Vector3<f64>,
    /// Accelerometer: change of the offset, m/s² a kelvin.
    pub accel_drift: Vector3<f64>,
    /// Gyro: offset at the beginning and at 25 °C, rad/s.
    pub gyro_bias: Vector3<f64>,
    /// Gyro: change of the offset, rad/s a kelvin.
    pub gyro_drift: Vector3<f64>,
    /// Magnetometer: soft iron.
    pub soft_iron: Matrix3<f64>,
    /// Magnetometer: hard iron, µT.
    pub hard_iron: Vector3<f64>,
}

impl Default for Specimen {
    /// Sensors that are right.
    fn default() -> Self {
        let (none, straight) = (Vector3::zeros(), Matrix3::identity());
        Self {
            accel_matrix: straight,
            lever: none,
            accel_bias: none,
            accel_drift: none,
            gyro_bias: none,
            gyro_drift: none,
            soft_iron: straight,
            hard_iron: none,
        }
    }
}
