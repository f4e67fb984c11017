//! Does our filter really use every sample of the stream? A sample that is refused costs less than one that is filtered.

use crate::stream::{self, Step};
use stampfly_eskf::{Eskf, EskfConfig, Estimator};

/// Panics unless every sample of so many steps goes into the estimate, after a first pass in which the filter has yet to
/// find its biases and gather a past to put late samples in. Returns how many there were a step: range, flow, barometer,
/// magnetometer.
#[must_use]
pub fn fused_per_step(name: &str, configuration: EskfConfig, steps: &[Step], count: u64) -> [f64; 4] {
    let mut filter = Eskf::new(configuration);
    filter.initialize(stream::START, &stream::calibration());
    let mut fused = [0u64; 4];
    for (k, step) in (0..stream::STEPS as u64 + count).zip(steps.iter().cycle()) {
        let fusions = stream::advance(&mut filter, stream::end_of(k), step);
        if k < stream::STEPS as u64 {
            continue;
        }
        for (sum, fusion) in fused.iter_mut().zip(fusions) {
            assert!(fusion.is_none_or(|fusion| fusion.is_fused()), "{name}, step {k}: {fusions:?}");
            *sum += u64::from(fusion.is_some());
        }
    }
    assert_eq!(filter.status().resets, 0, "{name} was reset");
    fused.map(|sum| sum as f64 / count as f64)
}

/// What [`fused_per_step`] has to be.
pub const MIX: [f64; 4] = [0.075, 0.25, 0.125, 0.0625];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_configuration_uses_every_sample() {
        let steps: Vec<Step> = (0..stream::STEPS).map(stream::step).collect();
        for (name, configuration) in stream::configurations() {
            assert_eq!(fused_per_step(name, configuration, &steps, 10 * stream::STEPS as u64), MIX, "{name}");
        }
    }

    #[test]
    fn one_that_is_not_used_is_noticed() {
        let steps: Vec<Step> = (0..stream::STEPS).map(stream::step).collect();
        let deaf = EskfConfig { mag_enable: false, ..stream::configurations()[0].1 };
        assert!(std::panic::catch_unwind(|| fused_per_step("deaf", deaf, &steps, 100)).is_err());
    }
}
