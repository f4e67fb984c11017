//! Estimation: every sensor in, the vehicle's state out.

use crate::config::{EstimatorKind, VehicleConfig};
use crate::topics::EstimationEnds as Ends;
use stampfly_bus::{Activation, Runnable};
use stampfly_eskf::{Complementary, Eskf, Estimator, Measurements, Pacer};

/// The estimators this vehicle can be told to use (`estimator.type`).
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
#[allow(clippy::large_enum_variant, reason = "there is one of them, for as long as the vehicle is on")]
enum Choice {
    Eskf(Eskf),
    Complementary(Complementary),
}

/// Estimation: every sensor in, the vehicle's state out.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
pub struct Estimation {
    estimator: Choice,
    /// Has the still-calibration been used?
    started: bool,
    pacer: Pacer,
}

impl Estimation {
    /// An estimation that waits for its calibration.
    ///
    /// Not inlined, and each filter is made where it stays: the stack has no room for copies of one beside all other runnables.
    #[inline(never)]
    #[must_use]
    pub fn new(config: &VehicleConfig) -> Self {
        let of = |estimator| Self { estimator, started: false, pacer: Pacer::default() };
        match config.estimator {
            EstimatorKind::Complementary => of(Choice::Complementary(Complementary::new(config.complementary))),
            EstimatorKind::Eskf => of(Choice::Eskf(Eskf::new(config.eskf))),
        }
    }
}

impl Runnable for Estimation {
    type Ends<'b> = Ends<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut Ends<'_>) {
        let feeding = (&mut self.started, &mut self.pacer);
        match &mut self.estimator {
            Choice::Eskf(estimator) => step(estimator, feeding, activation, ends),
            Choice::Complementary(estimator) => step(estimator, feeding, activation, ends),
        }
    }
}

#[inline(never)]
fn step(of: &mut impl Estimator, (started, pacer): (&mut bool, &mut Pacer), on: &Activation, ends: &mut Ends<'_>) {
    let (now, calibration) = (on.now(), ends.calibration.get());
    if calibration.complete && !*started {
        *started = true;
        of.initialize(now, calibration);
    }
    if ends.estimator_command.sample().is_some() {
        of.command(now, ends.estimator_command.get());
    }
    let measurements = Measurements {
        imu: &ends.sensor_imu,
        tof: &ends.sensor_tof,
        flow: &ends.sensor_flow,
        mag: &ends.sensor_mag,
        baro: &ends.sensor_baro,
        pose: &ends.external_pose,
    };
    pacer.feed(of, &measurements, |_, _, _| {});
    ends.estimate_state.publish(now, &of.estimate());
    ends.estimate_status.publish(now, &of.status());
}
