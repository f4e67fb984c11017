//! True sensor errors of one simulated vehicle: the reference for every calibration.
//!
//! Sensor models and chip emulators draw them from the seed; flight code has no access to them.
//! Noise is not included because calibration cannot remove it.

use nalgebra::{Matrix3, Vector3};

/// Sensor errors, body FRD: measured = `matrix · true + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Specimen {
    /// Accelerometer: scale and misalignment.
    pub accel_matrix: Matrix3<f64>,
    /// Accelerometer: position relative to the centre of mass, body, m.
    pub lever: Vector3<f64>,
    /// Accelerometer: offset at the start and at 25 °C, m/s².
    pub accel_bias: Vector3<f64>,
    /// Accelerometer: temperature coefficient of the offset, m/s²/K.
    pub accel_drift: Vector3<f64>,
    /// Gyro: offset at the start and at 25 °C, rad/s.
    pub gyro_bias: Vector3<f64>,
    /// Gyro: temperature coefficient of the offset, rad/s/K.
    pub gyro_drift: Vector3<f64>,
    /// Magnetometer: soft iron.
    pub soft_iron: Matrix3<f64>,
    /// Magnetometer: hard iron, µT.
    pub hard_iron: Vector3<f64>,
}

impl Default for Specimen {
    /// Sensors without errors.
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
