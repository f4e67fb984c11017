//! The interface of every estimator in this crate ([`Estimator`]) and the result of a measurement
//! ([`Fusion`]).

use crate::aid::airspeed::Wind;
use stampfly_types::messages::{
    BaroData, CalibrationResult, EstimateCorrection, EstimatorCommand, EstimatorStatus, FlowData, GnssData, GnssFix,
    ImuData, MagData, SensorFindings, StateEstimate, TofData,
};
use stampfly_types::{Instant, Origin, Quat, Vec3};

/// Smallest standard deviations assumed for a receiver, position in m and velocity in m/s: the
/// accuracy that a receiver states does not contain the errors of satellite clocks and orbits. EKF2
/// uses 0.5 and 0.3.
const LEAST_POSITION: f32 = 0.5;
const LEAST_SPEED: f32 = 0.15;

/// Result of a measurement.
///
/// The test ratio is the squared Mahalanobis distance of the innovation, yᵀ·S⁻¹·y, divided by that
/// of the gate: a measurement with a ratio of one lies on the gate.
#[must_use = "a measurement may have been refused, for ever, and nothing else says so at once"]
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fusion {
    /// Fused into the estimate.
    Fused {
        /// Test ratio, at most one.
        ratio: f32,
    },
    /// Rejected by the innovation gate.
    Gated {
        /// Test ratio, above one.
        ratio: f32,
    },
    /// The sensor was rejected for the whole lock-out time, so the estimate was reset to it.
    Reset,
    /// Not compared with the estimate.
    Refused(Refusal),
}

/// Reason for which a measurement was not compared with the estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Refusal {
    /// The estimator has not been initialised.
    NotInitialized,
    /// The driver marked it invalid, or its quality is too low.
    Quality,
    /// The sensor is flagged faulty and left out until it is consistent again, or the values are
    /// physically impossible for a vehicle.
    Implausible,
    /// A value is NaN or infinite.
    NotFinite,
    /// Outside the sensor's range.
    Range,
    /// The vehicle is tilted too far for the sensor's model.
    Tilt,
    /// Older than [`EskfConfig::horizon`](crate::EskfConfig::horizon), or from before the estimator
    /// started.
    Stale,
    /// Stamped more than 20 ms (the tolerated clock difference) after the last inertial sample.
    Future,
    /// Not newer than the last sample of this sensor: a duplicate, or out of order.
    Repeated,
    /// A quantity that the model requires is unknown, such as the height for flow or the reference
    /// for the magnetometer.
    Missing,
    /// This estimator does not use this sensor, or the sensor is disabled.
    NotUsed,
}

impl Fusion {
    /// Whether the measurement changed the estimate.
    #[must_use]
    pub const fn is_fused(self) -> bool {
        matches!(self, Self::Fused { .. } | Self::Reset)
    }
}

/// An estimator of a vehicle's state.
///
/// # Timing
/// Call [`predict`](Self::predict) for every inertial sample in order, and the `fuse_` functions
/// for other samples as they arrive. Time is an argument: `at` is the instant for which a sample is
/// valid. Samples may arrive late: [`Eskf`](crate::Eskf) compares them with the state at their own
/// time, as far back as [`horizon`](crate::EskfConfig::horizon), and refuses older ones.
///
/// # Validity
/// [`estimate`](Self::estimate) marks which outputs may be used. Values that are not finite are
/// refused and never reach the state.
pub trait Estimator {
    /// Starts, or restarts, from a still calibration. Position and velocity become zero.
    fn initialize(&mut self, at: Instant, calibration: &CalibrationResult);

    /// Takes the commands of the mode machine: on the ground, flying, accelerometer fault, resets.
    fn command(&mut self, at: Instant, command: &EstimatorCommand);

    /// Propagates the estimate to `at` with an inertial sample.
    fn predict(&mut self, at: Instant, imu: &ImuData);

    /// Fuses a range to the ground.
    fn fuse_tof(&mut self, at: Instant, tof: &TofData) -> Fusion;

    /// Fuses optical flow.
    fn fuse_flow(&mut self, at: Instant, flow: &FlowData) -> Fusion;

    /// Fuses a barometric altitude.
    fn fuse_baro(&mut self, at: Instant, baro: &BaroData) -> Fusion;

    /// Fuses a magnetic field.
    fn fuse_mag(&mut self, at: Instant, mag: &MagData) -> Fusion;

    /// Fuses an external velocity, world NED, m/s, with the standard deviation of each axis, m/s.
    /// An axis with an infinite standard deviation is ignored: a receiver without vertical speed, a
    /// wheel on a level floor.
    fn fuse_velocity(&mut self, at: Instant, velocity: &Vec3, sigma: &Vec3) -> Fusion;

    /// Fuses an external position, world NED, m, with the standard deviation of each axis, m (h_acc
    /// and v_acc of a satellite receiver). An axis with an infinite standard deviation is ignored,
    /// as for a two-dimensional fix. The default implementation refuses.
    fn fuse_position(&mut self, _at: Instant, _position: &Vec3, _sigma: &Vec3) -> Fusion {
        Fusion::Refused(Refusal::NotUsed)
    }

    /// Fuses an external attitude, body → world, with one standard deviation for all axes, rad. The
    /// default implementation refuses.
    fn fuse_attitude(&mut self, _at: Instant, _attitude: &Quat, _sigma: f32) -> Fusion {
        Fusion::Refused(Refusal::NotUsed)
    }

    /// Fuses a fix of a satellite receiver: its position relative to `origin`, then its velocity,
    /// each with the accuracy that the receiver states, bounded below by what receivers achieve.
    /// Returns the results of position and velocity, in this order.
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
        // A two-dimensional fix carries no altitude and no vertical speed: leave the vertical axes
        // out.
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

    /// Fuses an airspeed along the nose, m/s, with its standard deviation, m/s. The caller keeps
    /// the `wind` estimate that belongs to the sensor. The default implementation refuses.
    fn fuse_airspeed(&mut self, _at: Instant, _speed: f32, _sigma: f32, _wind: &mut Wind) -> Fusion {
        Fusion::Refused(Refusal::NotUsed)
    }

    /// Takes the findings of a monitor: a sensor that is flagged faulty is left out. The default
    /// implementation ignores them.
    fn heed(&mut self, _at: Instant, _findings: &SensorFindings) {}

    /// Applies a monitor's correction: removes the effect of a faulty sensor on the estimate.
    /// The default implementation ignores it.
    fn correct(&mut self, _at: Instant, _correction: &EstimateCorrection) {}

    /// The state, with the validity of each output.
    fn estimate(&self) -> StateEstimate;

    /// Innovations, counters and uncertainties for telemetry.
    fn status(&self) -> EstimatorStatus;
}
