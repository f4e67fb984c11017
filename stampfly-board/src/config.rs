//! Everything about the vehicle that can be tuned, as one value.
//!
//! Each crate owns its own configuration and its defaults; this struct only gathers them. The names people use are in
//! [`parameters`](crate::parameters).

use stampfly_control::{CascadeConfig, GeometricConfig, MotorConfig};
use stampfly_eskf::{ComplementaryConfig, EskfConfig};

/// Configuration of every component of one vehicle.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
pub struct VehicleConfig {
    /// 0: error-state Kalman filter, 1: complementary filter.
    pub estimator: f32,
    /// 0: cascade, 1: geometric.
    pub controller: f32,
    /// Error-state Kalman filter.
    pub eskf: EskfConfig,
    /// Complementary filter.
    pub complementary: ComplementaryConfig,
    /// Cascaded controller.
    pub cascade: CascadeConfig,
    /// Geometric controller.
    pub geometric: GeometricConfig,
    /// Motors and battery.
    pub motor: MotorConfig,
}

impl VehicleConfig {
    pub(crate) fn uses_complementary_estimator(&self) -> bool {
        self.estimator >= 0.5
    }

    pub(crate) fn uses_geometric_controller(&self) -> bool {
        self.controller >= 0.5
    }
}
