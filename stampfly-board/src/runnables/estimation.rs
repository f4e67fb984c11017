//! Estimation: every sensor in, the vehicle's state out.

use crate::config::{EstimatorKind, VehicleConfig};
use crate::topics::EstimationEnds;
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
    feeding: Feeding,
}

/// What is known of the estimator's input.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
struct Feeding {
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
        let estimator = match config.estimator {
            EstimatorKind::Complementary => Choice::Complementary(Complementary::new(config.complementary)),
            EstimatorKind::Eskf => Choice::Eskf(Eskf::new(config.eskf)),
        };
        Self { estimator, feeding: Feeding::default() }
    }
}

impl Runnable for Estimation {
    type Ends<'b> = EstimationEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut EstimationEnds<'_>) {
        match &mut self.estimator {
            Choice::Eskf(estimator) => step(estimator, &mut self.feeding, activation, ends),
            Choice::Complementary(estimator) => step(estimator, &mut self.feeding, activation, ends),
        }
    }
}

fn step(estimator: &mut impl Estimator, feeding: &mut Feeding, activation: &Activation, ends: &mut EstimationEnds<'_>) {
    let now = activation.now();
    let calibration = ends.calibration.get();
    if calibration.complete && !feeding.started {
        feeding.started = true;
        estimator.initialize(now, calibration);
    }
    if ends.estimator_command.sample().is_some() {
        estimator.command(now, ends.estimator_command.get());
    }
    let measurements = Measurements {
        imu: &ends.sensor_imu,
        tof: &ends.sensor_tof,
        flow: &ends.sensor_flow,
        mag: &ends.sensor_mag,
        baro: &ends.sensor_baro,
        pose: &ends.external_pose,
    };
    feeding.pacer.feed(estimator, &measurements, |_, _, _| {});
    ends.estimate_state.publish(now, &estimator.estimate());
    ends.estimate_status.publish(now, &estimator.status());
}
