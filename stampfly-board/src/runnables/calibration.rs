//! Calibration: still samples in, biases and the first attitude out. Done once after power-on.

use crate::config::VehicleConfig;
use crate::topics::CalibrationEnds;
use stampfly_bus::{Activation, Runnable};
use stampfly_eskf::calibration::StillCalibration;
use stampfly_types::messages::CalibrationResult;

/// Calibration: still samples in, biases and the first attitude out.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
pub struct Calibration {
    calibration: StillCalibration,
    published: CalibrationResult,
}

impl Calibration {
    /// A calibration that begins with the next sample.
    #[must_use]
    pub fn new(_: &VehicleConfig) -> Self {
        Self::default()
    }
}

impl Runnable for Calibration {
    type Ends<'b> = CalibrationEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut CalibrationEnds<'_>) {
        for sample in ends.sensor_mag.iter() {
            self.calibration.add_mag(&sample.data);
        }
        for sample in ends.sensor_baro.iter() {
            self.calibration.add_baro(&sample.data);
        }
        for sample in ends.sensor_imu.iter() {
            // Motion shows in the result as progress that began again; the kind of motion is not published.
            let _ = self.calibration.step(sample.at, &sample.data);
        }
        // Only a change is published.
        let result = self.calibration.result();
        if result != self.published {
            self.published = result;
            ends.calibration.publish(activation.now(), &result);
        }
    }
}
