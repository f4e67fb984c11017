//! Counters of measurement results, by sensor and reason.
//!
//! Use them for telemetry, pre-flight checks and diagnosis. [`Fusion`] reports a single
//! measurement; `EstimatorStatus` has room for five sensors and no reasons.

use crate::estimator::{Fusion, Refusal};
use crate::measurements::Aiding;

/// Number of reasons for a refusal, and of sensors.
const REASONS: usize = Refusal::NotUsed as usize + 1;
const SENSORS: usize = Aiding::Own as usize + 1;

/// Counters of one sensor since the estimator was constructed. They saturate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Tally {
    /// Measurements fused into the estimate.
    pub fused: u32,
    /// Measurements rejected by the gate.
    pub gated: u32,
    /// Resets of the state to this sensor.
    pub resets: u32,
    refused: [u16; REASONS],
}

impl Tally {
    /// Number of refusals for this reason; saturates at 65535.
    #[must_use]
    pub fn refused(&self, reason: Refusal) -> u32 {
        self.refused.get(reason as usize).copied().map_or(0, u32::from)
    }

    /// Number of refusals for all reasons.
    #[must_use]
    pub fn all_refused(&self) -> u32 {
        self.refused.iter().copied().map(u32::from).sum()
    }

    fn add(&mut self, fusion: Fusion) {
        let count = match fusion {
            Fusion::Fused { .. } => &mut self.fused,
            Fusion::Gated { .. } => &mut self.gated,
            Fusion::Reset => &mut self.resets,
            Fusion::Refused(reason) => {
                if let Some(count) = self.refused.get_mut(reason as usize) {
                    *count = count.saturating_add(1);
                }
                return;
            }
        };
        *count = count.saturating_add(1);
    }
}

/// Counters of all sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Tallies {
    sensors: [Tally; SENSORS],
}

impl Tallies {
    pub(crate) fn add(&mut self, sensor: Aiding, fusion: Fusion) {
        if let Some(tally) = self.sensors.get_mut(sensor as usize) {
            tally.add(fusion);
        }
    }

    pub(crate) fn of(&self, sensor: Aiding) -> Tally {
        self.sensors.get(sensor as usize).copied().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_answer_is_counted_once_for_its_sensor_and_reason() {
        let mut tallies = Tallies::default();
        for _ in 0..70_000 {
            tallies.add(Aiding::Own, Fusion::Refused(Refusal::NotUsed));
        }
        tallies.add(Aiding::Own, Fusion::Refused(Refusal::Stale));
        tallies.add(Aiding::Mag, Fusion::Gated { ratio: 2.0 });
        tallies.add(Aiding::Mag, Fusion::Fused { ratio: 0.1 });
        tallies.add(Aiding::Mag, Fusion::Reset);
        let own = tallies.of(Aiding::Own);
        assert_eq!((own.refused(Refusal::NotUsed), own.refused(Refusal::Stale)), (65_535, 1));
        assert_eq!((own.fused, own.gated, own.resets, own.all_refused()), (0, 0, 0, 65_536));
        let mag = tallies.of(Aiding::Mag);
        assert_eq!((mag.fused, mag.gated, mag.resets, mag.all_refused()), (1, 1, 1, 0));
        assert_eq!(tallies.of(Aiding::Tof), Tally::default());
    }
}
