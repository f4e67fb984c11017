//! Calibration: still samples in, biases and the first attitude out. Done once after power-on.

use crate::wiring;
use heapless::Vec;
use stampfly_bus::{Activation, Runnable, Stamped};
use stampfly_eskf::calibration::StillCalibration;
use stampfly_types::messages::*;

/// Calibration: still samples in, biases and the first attitude out.
pub struct Calibration<'b> {
    ports: CalibrationPorts<'b>,
    calibration: StillCalibration,
    imu_samples: Vec<Stamped<ImuData>, 16>,
    mag_samples: Vec<Stamped<MagData>, 8>,
    baro_samples: Vec<Stamped<BaroData>, 8>,
    published: CalibrationResult,
}

/// The ends it owns.
pub struct CalibrationPorts<'b> {
    /// Inertial samples.
    pub imu: wiring::sensor_imu::Rx<'b>,
    /// Magnetic field.
    pub mag: wiring::sensor_mag::Rx<'b>,
    /// Air pressure.
    pub baro: wiring::sensor_baro::Rx<'b>,
    /// What was found.
    pub result: wiring::calibration::Tx<'b>,
}

impl<'b> Calibration<'b> {
    /// Nothing collected yet.
    #[must_use]
    pub fn new(ports: CalibrationPorts<'b>) -> Self {
        Self {
            ports,
            calibration: StillCalibration::default(),
            imu_samples: Vec::new(),
            mag_samples: Vec::new(),
            baro_samples: Vec::new(),
            published: CalibrationResult::default(),
        }
    }
}

impl Runnable for Calibration<'_> {
    fn read(&mut self, activation: &mut Activation) {
        activation.drain(&mut self.ports.imu, &mut self.imu_samples);
        activation.drain(&mut self.ports.mag, &mut self.mag_samples);
        activation.drain(&mut self.ports.baro, &mut self.baro_samples);
    }

    fn run(&mut self, activation: &mut Activation) {
        for sample in &self.mag_samples {
            self.calibration.add_mag(&sample.data);
        }
        for sample in &self.baro_samples {
            self.calibration.add_baro(&sample.data);
        }
        for sample in &self.imu_samples {
            // Motion shows in the result as progress that began again; what kind of motion it was is not published.
            let _ = self.calibration.step(sample.at, &sample.data);
        }
        // A result that does not change any more is not news.
        let result = self.calibration.result();
        if result != self.published {
            self.published = result;
            self.ports.result.publish(activation.now(), &result);
        }
    }
}
