//! Estimation: every sensor in, the vehicle's state out.

use crate::config::{EstimatorKind, VehicleConfig};
use crate::topics::EstimationEnds;
use stampfly_bus::{Activation, Runnable};
use stampfly_eskf::{Complementary, Eskf, Estimator, Measurements, Pacer};
use stampfly_types::Instant;

/// Estimation: every sensor in, the vehicle's state out.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "key-frame", derive(serde::Serialize, serde::Deserialize))]
pub struct Estimation {
    /// Which one flies. Each has its place, so that it can begin again there: the other one waits to be initialised.
    kind: EstimatorKind,
    eskf: Eskf,
    complementary: Complementary,
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
        Self {
            kind: config.estimator,
            eskf: Eskf::new(config.eskf),
            complementary: Complementary::new(config.complementary),
            started: false,
            pacer: Pacer::default(),
        }
    }

    /// The same in its place, with little stack.
    pub(crate) fn begin_again(&mut self, config: &VehicleConfig) {
        (self.kind, self.started, self.pacer) = (config.estimator, false, Pacer::default());
        self.eskf.begin_again(&config.eskf);
        self.complementary = Complementary::new(config.complementary);
    }
}

impl Runnable for Estimation {
    type Ends<'b> = EstimationEnds<'b>;

    fn run(&mut self, activation: &mut Activation, ends: &mut EstimationEnds<'_>) {
        let feeding = (&mut self.started, &mut self.pacer);
        match self.kind {
            EstimatorKind::Eskf => step(&mut self.eskf, feeding, activation.now(), ends),
            EstimatorKind::Complementary => step(&mut self.complementary, feeding, activation.now(), ends),
        }
    }
}

// By itself for each estimator: the one that flies is kept in fast memory.
#[inline(never)]
fn step(
    estimator: &mut impl Estimator,
    (started, pacer): (&mut bool, &mut Pacer),
    now: Instant,
    ends: &mut EstimationEnds<'_>,
) {
    let calibration = ends.calibration.get();
    if calibration.complete && !*started {
        *started = true;
        estimator.initialize(now, calibration);
    }
    if ends.estimator_command.sample().is_some() {
        estimator.command(now, ends.estimator_command.get());
    }
    // As long as they hold: the estimator may have begun again since.
    if ends.findings.sample().is_some() {
        estimator.heed(now, ends.findings.get());
    }
    if ends.estimate_correction.is_new() {
        estimator.correct(now, ends.estimate_correction.get());
    }
    let measurements = Measurements {
        imu: &ends.sensor_imu,
        tof: &ends.sensor_tof,
        flow: &ends.sensor_flow,
        mag: &ends.sensor_mag,
        baro: &ends.sensor_baro,
        pose: &ends.external_pose,
    };
    pacer.feed(estimator, &measurements, |_, _, _| {});
    ends.estimate_state.publish(now, &estimator.estimate());
    ends.estimate_status.publish(now, &estimator.status());
}
