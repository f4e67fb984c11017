//! What every estimator of the family offers, and what it answers when it is given a measurement.

use crate::aid::airspeed::Wind;
use stampfly_types::messages::{
    BaroData, CalibrationResult, EstimateCorrection, EstimatorCommand, EstimatorStatus, FlowData, GnssData, GnssFix,
    ImuData, MagData, SensorFindings, StateEstimate, TofData,
};
use stampfly_types::{Instant, Origin, Quat, Vec3};

/// A receiver's position is not better than this along an axis, m, whatever it says of it, and its velocity not than this, m/s: the errors of its
/// satellites' clocks and orbits are in no accuracy that it states. EKF2 takes 0.5 and 0.3.
const LEAST_POSITION: f32 = 0.5;
const LEAST_SPEED: f32 = 0.15;

/// What became of a measurement.
///
/// The test ratio is the squared Mahalanobis distance of the innovation, yᵀ·S⁻¹·y, divided by the gate's: at one the
/// measurement sits on the gate.
#[must_use = "a measurement may have been refused, for ever, and nothing else says so at once"]
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fusion {
    /// It went into the estimate.
    Fused {
        /// Its test ratio, at most one.
        ratio: f32,
    },
    /// It disagrees with the estimate and was left out.
    Gated {
        /// Its test ratio, above one.
        ratio: f32,
    },
    /// It disagreed for so long that the estimate was moved to it.
    Reset,
    /// It was not looked at.
    Refused(Refusal),
}

/// Why a measurement was not looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Refusal {
    /// The estimator has not been initialised.
    NotInitialized,
    /// The driver does not vouch for it, or its quality is too low.
    Quality,
    /// The sensor contradicts the others, and is left out until it agrees with them; or no vehicle is or moves like this.
    Implausible,
    /// A number in it is not finite.
    NotFinite,
    /// Outside the sensor's range.
    Range,
    /// The vehicle is tilted too far for the sensor's model.
    Tilt,
    /// Older than the estimator can still place ([`EskfConfig::horizon`](crate::EskfConfig::horizon)), or before it started.
    Stale,
    /// Stamped later than the last inertial sample by more than clocks differ: two hundredths of a second.
    Future,
    /// Not newer than the last one of this sensor: the same sample again, or two in the wrong order.
    Repeated,
    /// Something the model needs is not known (no height for flow, no reference for the magnetometer).
    Missing,
    /// This estimator has no use for this sensor, or it is switched off.
    NotUsed,
}

impl Fusion {
    /// Did the measurement change the estimate?
    #[must_use]
    pub const fn is_fused(self) -> bool {
        matches!(self, Self::Fused { .. } | Self::Reset)
    }
}

/// An estimator of a vehicle's state.
///
/// # Timing
/// Call [`predict`](Self::predict) for every inertial sample in order, and the `fuse_` functions for other samples
/// as they arrive. Time is an argument: `at` is the instant a sample is valid for. Samples may arrive late: the
/// [`Eskf`](crate::Eskf) compares them with the state of their own time, as far back as its
/// [`horizon`](crate::EskfConfig::horizon), and refuses older ones.
///
/// # Validity
/// [`estimate`](Self::estimate) marks every output that may not be used. Input that is not finite never reaches the
/// state.
pub trait Estimator {
    /// Starts, or starts again, from a still-calibration. Position and velocity become zero.
    fn initialize(&mut self, at: Instant, calibration: &CalibrationResult);

    /// Obeys the mode machine.
    fn command(&mut self, at: Instant, command: &EstimatorCommand);

    /// Moves the estimate to `at` with an inertial sample.
    fn predict(&mut self, at: Instant, imu: &ImuData);

    /// Uses a range to the ground.
    fn fuse_tof(&mut self, at: Instant, tof: &TofData) -> Fusion;

    /// Uses optical flow.
    fn fuse_flow(&mut self, at: Instant, flow: &FlowData) -> Fusion;

    /// Uses a barometric altitude.
    fn fuse_baro(&mut self, at: Instant, baro: &BaroData) -> Fusion;

    /// Uses a magnetic field.
    fn fuse_mag(&mut self, at: Instant, mag: &MagData) -> Fusion;

    /// Uses a velocity measured from outside, world NED, m/s, with the standard deviation of each axis, m/s. An axis with an
    /// infinite one was not measured and is not looked at: a receiver without a vertical speed, a wheel on a level floor.
    fn fuse_velocity(&mut self, at: Instant, velocity: &Vec3, sigma: &Vec3) -> Fusion;

    /// Uses a position measured from outside, world NED, m, with the standard deviation of each axis, m; a satellite receiver
    /// calls them h_acc and v_acc. An axis with an infinite one was not measured: that is a fix in two dimensions. An
    /// estimator without a use for positions refuses.
    fn fuse_position(&mut self, _at: Instant, _position: &Vec3, _sigma: &Vec3) -> Fusion {
        Fusion::Refused(Refusal::NotUsed)
    }

    /// Uses an attitude measured from outside, body → world, with one standard deviation for all axes, rad. An estimator
    /// without a use for it refuses.
    fn fuse_attitude(&mut self, _at: Instant, _attitude: &Quat, _sigma: f32) -> Fusion {
        Fusion::Refused(Refusal::NotUsed)
    }

    /// Uses a fix of a satellite receiver: its position relative to `origin`, and its velocity, each with the accuracy that the receiver
    /// states, though not with a better one than receivers have. What became of the two, in this order.
    ///
    /// ```
    /// use stampfly_eskf::{Eskf, EskfConfig, Estimator, Fusion, Refusal};
    /// use stampfly_types::{Instant, Origin, messages::GnssData};
    /// let mut eskf = Eskf::new(EskfConfig::outdoors());
    /// let nothing = GnssData::default();
    /// let fusions = eskf.fuse_gnss(Instant::ZERO, &nothing, &Origin::default());
    /// assert_eq!(fusions, [Fusion::Refused(Refusal::Quality); 2], "without satellites");
    /// ```
    fn fuse_gnss(&mut self, at: Instant, gnss: &GnssData, origin: &Origin) -> [Fusion; 2] {
        let accuracy = [gnss.horizontal_accuracy, gnss.vertical_accuracy, gnss.speed_accuracy];
        if gnss.fix == GnssFix::None || !accuracy.iter().all(|deviation| *deviation > 0.0) {
            return [Fusion::Refused(Refusal::Quality); 2];
        }
        let [horizontal, vertical, speed] = accuracy;
        let [horizontal, speed] = [horizontal.max(LEAST_POSITION), speed.max(LEAST_SPEED)];
        let is_high = gnss.fix == GnssFix::ThreeDimensional;
        let [vertical, sink] =
            if is_high { [vertical.max(LEAST_POSITION), speed] } else { [f32::INFINITY, f32::INFINITY] };
        let [north, east] = origin.local(gnss.latitude, gnss.longitude);
        let position = Vec3::new(north, east, origin.down(gnss.altitude));
        [
            self.fuse_position(at, &position, &Vec3::new(horizontal, horizontal, vertical)),
            self.fuse_velocity(at, &gnss.velocity, &Vec3::new(speed, speed, sink)),
        ]
    }

    /// Uses an airspeed along the nose, m/s, with its standard deviation, m/s, and the wind that goes with it, which whoever has the sensor
    /// keeps. An estimator without a use for it refuses.
    fn fuse_airspeed(&mut self, _at: Instant, _speed: f32, _sigma: f32, _wind: &mut Wind) -> Fusion {
        Fusion::Refused(Refusal::NotUsed)
    }

    /// Takes what a monitor has found about the sensors: one that does not measure is left out. An
    /// estimator that has no use for it goes on as before.
    fn heed(&mut self, _at: Instant, _findings: &SensorFindings) {}

    /// Puts right what a sensor that did not measure has done to the estimate.
    fn correct(&mut self, _at: Instant, _correction: &EstimateCorrection) {}

    /// The state, with a validity per output.
    fn estimate(&self) -> StateEstimate;

    /// How the measurements fared.
    fn status(&self) -> EstimatorStatus;
}
