//! The attitude filter as an [`Estimator`]: steps from time stamps, validity of each output.
//!
//! Position, velocity and height are never valid, and their sensors are refused with
//! [`Refusal::NotUsed`]. Use it as the fallback of a vehicle after the loss of all other
//! estimators.

use super::bookkeeping::Bookkeeping;
use super::filter::AttitudeFilter;
use crate::estimator::{Estimator, Fusion, Refusal};
use stampfly_types::messages::{
    BaroData, CalibrationResult, EstimatorCommand, EstimatorStatus, FlowData, ImuData, MagData, SensorMask,
    StateEstimate, TofData, Validity,
};
use stampfly_types::{Duration, Instant, Vec3, math};

/// Index of the magnetometer in the counters of the status.
const MAG: usize = 3;
/// Assumed period before the first magnetometer sample, s.
const FIRST_PERIOD: f32 = 0.01;
/// A field stamped farther ahead than this is refused.
const FUTURE: Duration = Duration::from_millis(100);
/// Time after its last use for which the magnetometer counts as active.
const RECENT: Duration = Duration::from_secs(1);
/// Largest standard deviation of a valid heading, rad.
const HEADING_SIGMA: f32 = 0.35;

impl Estimator for AttitudeFilter {
    fn initialize(&mut self, at: Instant, calibration: &CalibrationResult) {
        if !calibration.gyro_bias.iter().chain(calibration.specific_force.iter()).all(|v| v.is_finite()) {
            return;
        }
        let command = self.book.command;
        *self = Self::from_calibration(self.config, calibration);
        self.book =
            Bookkeeping { now: at, initialized: true, calibration: *calibration, command, ..Default::default() };
    }

    /// Only a full reset is obeyed: rest is detected by the filter itself, and there is no position
    /// to reset.
    fn command(&mut self, at: Instant, command: &EstimatorCommand) {
        let previous = core::mem::replace(&mut self.book.command, *command);
        if command.full_resets != previous.full_resets && self.book.initialized {
            let calibration = self.book.calibration;
            self.initialize(at, &calibration);
        }
    }

    fn predict(&mut self, at: Instant, imu: &ImuData) {
        if self.book.initialized && at > self.book.now {
            let dt = at.since(self.book.now).seconds();
            self.book.now = at;
            self.step(&imu.accel, &imu.gyro, dt);
        }
    }

    fn fuse_tof(&mut self, _: Instant, _: &TofData) -> Fusion {
        Fusion::Refused(Refusal::NotUsed)
    }

    fn fuse_flow(&mut self, _: Instant, _: &FlowData) -> Fusion {
        Fusion::Refused(Refusal::NotUsed)
    }

    fn fuse_baro(&mut self, _: Instant, _: &BaroData) -> Fusion {
        Fusion::Refused(Refusal::NotUsed)
    }

    fn fuse_mag(&mut self, at: Instant, mag: &MagData) -> Fusion {
        let book = &self.book;
        if !book.initialized {
            return Fusion::Refused(Refusal::NotInitialized);
        }
        if book.mag_at.is_some_and(|last| at <= last) {
            return Fusion::Refused(Refusal::Repeated);
        }
        if at > book.now + FUTURE {
            return Fusion::Refused(Refusal::Future);
        }
        // A field ahead of the last inertial sample counts as having its time.
        let age = if at < book.now { book.now.since(at).seconds() } else { 0.0 };
        let dt = book.mag_at.map_or(FIRST_PERIOD, |last| at.since(last).seconds());
        let fusion = self.field(&mag.field, age, dt);
        let innovation = self.heading_innovation();
        let book = &mut self.book;
        let count = |counters: &mut [u32; 5]| {
            if let Some(counter) = counters.get_mut(MAG) {
                *counter = counter.wrapping_add(1);
            }
        };
        match fusion {
            Fusion::Refused(_) => return fusion,
            Fusion::Fused { ratio } | Fusion::Gated { ratio } => book.status.mag_ratio = ratio,
            Fusion::Reset => book.status.resets = book.status.resets.wrapping_add(1),
        }
        book.mag_at = Some(at);
        book.status.mag_innovation = innovation;
        count(&mut book.status.offered);
        if fusion.is_fused() {
            book.mag_fused = Some(at);
        } else {
            count(&mut book.status.refused);
        }
        fusion
    }

    fn fuse_velocity(&mut self, _: Instant, _: &Vec3, _: &Vec3) -> Fusion {
        Fusion::Refused(Refusal::NotUsed)
    }

    fn estimate(&self) -> StateEstimate {
        let book = &self.book;
        let recent = book.mag_fused.is_some_and(|at| book.now.since(at) < RECENT);
        // Without a magnetometer the heading is relative to the start and as good as the gyro.
        let heading = book.mag_at.is_none() || self.heading_sigma() < HEADING_SIGMA;
        StateEstimate {
            attitude: self.attitude(),
            angular_rate: self.rate(),
            specific_force: self.specific_force(),
            gyro_bias: self.gyro_bias(),
            valid: Validity::NONE
                .set(Validity::TILT, book.initialized)
                .set(Validity::HEADING, book.initialized && heading),
            sensors: SensorMask::NONE
                .set(SensorMask::IMU | SensorMask::ACCEL_ATTITUDE, book.initialized)
                .set(SensorMask::MAG, recent)
                .set(SensorMask::STATIONARY, self.is_stationary()),
            ..StateEstimate::default()
        }
    }

    fn status(&self) -> EstimatorStatus {
        let down = self.attitude_without_field().inverse() * Vec3::z();
        let measured = -self.specific_force();
        EstimatorStatus {
            accel_innovation: math::atan2(measured.cross(&down).norm(), measured.dot(&down)),
            ..self.book.status
        }
    }
}
