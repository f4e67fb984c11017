//! Calibration: still samples in, biases and the first attitude out, once after power-on; later what somebody asks for.

use crate::config::VehicleConfig;
use crate::topics::CalibrationEnds;
use stampfly_bus::{Activation, Runnable};
use stampfly_eskf::calibration::{CalibrationSession, StillCalibration};
use stampfly_types::{Instant, messages::CalibrationResult};

/// Calibration: still samples in, biases and the first attitude out.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
pub struct Calibration {
    calibration: StillCalibration,
    published: CalibrationResult,
    session: CalibrationSession,
}

impl Calibration {
    /// A calibration that begins with the next sample.
    #[must_use]
    pub fn new(config: &VehicleConfig) -> Self {
        Self {
            calibration: StillCalibration::default(),
            published: CalibrationResult::default(),
            session: CalibrationSession::new(&config.corrections),
        }
    }
}

impl Runnable for Calibration {
    type Ends<'b> = CalibrationEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut CalibrationEnds<'_>) {
        let now = activation.now();
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
            ends.calibration.publish(now, &result);
        }
        if self.session.is_running() || !ends.calibration_request.is_empty() {
            self.go_on(now, ends);
        }
    }
}

impl Calibration {
    /// What somebody has asked for. Seldom, so apart: its code is not fetched in flight.
    #[cold]
    #[inline(never)]
    fn go_on(&mut self, now: Instant, ends: &mut CalibrationEnds<'_>) {
        ends.calibration_request.iter().for_each(|request| self.session.request(now, request.data.kind));
        if ends.flight_status.get().armed {
            self.session.arm();
        }
        ends.sensor_mag.iter().for_each(|sample| self.session.mag(sample.at, &sample.data));
        ends.sensor_imu.iter().for_each(|sample| self.session.imu(sample.at, &sample.data));
        if let Some(report) = self.session.news() {
            ends.calibration_report.publish(now, &report);
        }
    }
}
