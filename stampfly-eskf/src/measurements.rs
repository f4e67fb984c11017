//! The samples of one step ([`Measurements`]) and the order in which an estimator receives them
//! ([`feed`]).
//!
//! Vehicle, replay, benchmark and consistency tests all call [`feed`], so that they exercise the
//! estimator in the same order as in flight.

use crate::estimator::{Estimator, Fusion};
use stampfly_types::messages::{BaroData, ExternalPose, FlowData, ImuData, MagData, TofData};
use stampfly_types::{Instant, Stamped, Vec3};

/// The samples since the last step. Each list is sorted, oldest first.
#[derive(Clone, Copy, Debug, Default)]
pub struct Measurements<'a> {
    /// Inertial samples.
    pub imu: &'a [Stamped<ImuData>],
    /// Ranges to the ground.
    pub tof: &'a [Stamped<TofData>],
    /// Optical flow.
    pub flow: &'a [Stamped<FlowData>],
    /// Magnetic field.
    pub mag: &'a [Stamped<MagData>],
    /// Air pressure.
    pub baro: &'a [Stamped<BaroData>],
    /// Poses from outside. A standard deviation of zero means that this part is absent.
    pub pose: &'a [Stamped<ExternalPose>],
}

/// Source of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Aiding {
    /// Range finder.
    Tof,
    /// Optical flow.
    Flow,
    /// Magnetometer.
    Mag,
    /// Barometer.
    Baro,
    /// External position.
    Position,
    /// External attitude.
    Attitude,
    /// External velocity.
    Velocity,
    /// Gravity, an update that the filter makes from its own accelerometer samples.
    Gravity,
    /// A measurement with a user's model ([`Eskf::fuse`](crate::Eskf::fuse)).
    Own,
}

/// Feeds an estimator: first the inertial samples, then the others, sensor by sensor. `fused` is
/// called with the result of each measurement.
///
/// ```
/// use stampfly_eskf::{Eskf, EskfConfig, Estimator, Measurements, feed};
/// use stampfly_types::{Instant, Stamped, messages::{CalibrationResult, ImuData, TofData}};
///
/// let mut estimator = Eskf::new(EskfConfig::default());
/// estimator.initialize(Instant::ZERO, &CalibrationResult::default());
/// let imu = [Stamped { at: Instant::from_micros(2_500), generation: 1, data: ImuData::default() }];
/// let range = TofData { distance: 0.3, valid: true, ..Default::default() };
/// let tof = [Stamped { at: Instant::from_micros(2_000), generation: 1, data: range }];
/// let mut told = 0;
/// feed(&mut estimator, &Measurements { imu: &imu, tof: &tof, ..Default::default() }, |_, _, _| told += 1);
/// assert_eq!(told, 1);
/// ```
pub fn feed<E: Estimator + ?Sized>(
    estimator: &mut E,
    measurements: &Measurements<'_>,
    mut fused: impl FnMut(Aiding, Instant, Fusion),
) {
    let Measurements { imu, tof, flow, mag, baro, pose } = measurements;
    // Inertial samples first: every measurement is compared with a state that has been propagated
    // past it.
    for sample in *imu {
        estimator.predict(sample.at, &sample.data);
    }
    for sample in *tof {
        fused(Aiding::Tof, sample.at, estimator.fuse_tof(sample.at, &sample.data));
    }
    for sample in *flow {
        fused(Aiding::Flow, sample.at, estimator.fuse_flow(sample.at, &sample.data));
    }
    for sample in *mag {
        fused(Aiding::Mag, sample.at, estimator.fuse_mag(sample.at, &sample.data));
    }
    for sample in *baro {
        fused(Aiding::Baro, sample.at, estimator.fuse_baro(sample.at, &sample.data));
    }
    for Stamped { at, data, .. } in *pose {
        if data.position_sigma > 0.0 {
            let sigma = data.position_sigma;
            fused(Aiding::Position, *at, estimator.fuse_position(*at, &data.position, &Vec3::new(sigma, sigma, sigma)));
        }
        if data.attitude_sigma > 0.0 {
            fused(Aiding::Attitude, *at, estimator.fuse_attitude(*at, &data.attitude, data.attitude_sigma));
        }
    }
}
