//! Mean square sample-to-sample change of a signal.

use stampfly_types::{Instant, Vec3};

/// Time constant of the mean, s: a few propeller periods.
const MEAN: f32 = 0.05;
/// Upper bound on the interval between samples, s.
const LONGEST_STEP: f32 = 0.05;

/// Mean square of the change from sample to sample, averaged over the axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Vibration {
    last: Option<(Instant, Vec3)>,
    mean_square: f32,
}

impl Vibration {
    /// Adds the next sample. Values that are not finite are skipped.
    pub(crate) fn add(&mut self, at: Instant, sample: &Vec3) {
        if !sample.norm_squared().is_finite() {
            return;
        }
        if let Some((last, before)) = self.last.replace((at, *sample)) {
            let dt = at.since(last).seconds().min(LONGEST_STEP);
            let change = (sample - before).norm_squared() * (1.0 / 3.0);
            self.mean_square += (change - self.mean_square) * (dt / (MEAN + dt));
        }
    }

    /// In the signal's unit squared.
    pub(crate) fn mean_square(&self) -> f32 {
        self.mean_square
    }
}
