//! Bridges corrupt inertial samples: shifted frames, registers of `0x8000`, spikes.
//!
//! A sample that [`ImuData::is_garbled`] flags is replaced by the last accepted one. Persistent
//! data is not a glitch: from the fourth consecutive flagged sample on, samples are used if they
//! follow from each other as a body moves. The twenty-first flagged sample (50 ms at 400 Hz) is
//! used in any case, because a vehicle can fly that long on its last rates but no longer. Unrelated
//! spikes do not follow from each other and stay bridged until then.
//!
//! Integrating one corrupt sample costs more than replacing it: 8 g for 2.5 ms are 0.2 m/s, and
//! 2000 °/s are 5° of tilt.

use crate::config::EskfConfig;
use stampfly_types::messages::ImuData;
use stampfly_types::{Instant, Vec3};

/// Largest numbers of consecutive flagged samples that are bridged: consistent with each other, and
/// any.
const FOLLOWING: u32 = 3;
const LONGEST: u32 = 20;

/// The last accepted sample and the flagged ones since.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Bridge {
    last: Option<(Instant, ImuData)>,
    /// Rate of the last flagged sample, rad/s.
    garbled: Vec3,
    /// Consecutive flagged samples, and how many of them are consistent with each other.
    bridged: u32,
    following: u32,
}

impl Bridge {
    /// The replacement of a finite sample; `None` if the sample itself is to be used.
    pub(super) fn step(&mut self, config: &EskfConfig, at: Instant, imu: &ImuData) -> Option<ImuData> {
        let garbled = |elapsed, rate: Vec3| {
            imu.is_garbled(Some((elapsed, rate)), config.angular_acceleration, config.accel_full_scale)
        };
        if let Some((last, before)) = self.last {
            let elapsed = at.since(last);
            if garbled(elapsed, before.gyro) {
                let follows = self.bridged > 0 && !garbled(elapsed, self.garbled);
                self.following = if follows { self.following + 1 } else { 1 };
                self.bridged += 1;
                self.garbled = imu.gyro;
                if self.following <= FOLLOWING && self.bridged <= LONGEST {
                    // Restamped: otherwise the rate change allowed to the next sample would grow
                    // with the burst.
                    self.last = Some((at, before));
                    return Some(before);
                }
            }
        }
        (self.bridged, self.following) = (0, 0);
        self.last = Some((at, *imu));
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Number of accepted samples among the last ones, which have these rates about x and y after a
    /// rest.
    fn believed(rates: &[[f32; 2]]) -> usize {
        let (config, mut bridge) = (EskfConfig::default(), Bridge::default());
        let still = [[0.0; 2]; 8];
        let samples = still.iter().chain(rates).enumerate().map(|(n, [x, y])| {
            let imu = ImuData { gyro: Vec3::new(*x, *y, 0.0), ..ImuData::default() };
            bridge.step(&config, Instant::from_micros(2_500 * n as u64), &imu).is_none()
        });
        samples.skip(still.len()).filter(|believed| *believed).count()
    }

    #[test]
    fn what_goes_on_is_believed_from_the_fourth_sample_on() {
        assert_eq!(believed(&[[20.0, 0.0]; 10]), 7);
    }

    #[test]
    fn spikes_that_come_together_are_not() {
        assert_eq!(believed(&[[-20.0, 0.0], [0.0, -20.0], [0.0, 20.0], [0.0, -20.0], [20.0, 0.0]]), 0);
        assert_eq!(believed(&[[15.0, 0.0], [-15.0, 0.0]]), 0, "what is allowed does not grow with the first");
    }

    #[test]
    fn nothing_is_bridged_for_longer_than_50_ms() {
        // No sample follows from the one before, nor from the first accepted one.
        let others = [[-20.0, 0.0], [0.0, 20.0], [0.0, -20.0]];
        let noise: [[f32; 2]; 42] = core::array::from_fn(|n| if n == 20 { [20.0, 0.0] } else { others[n % 3] });
        assert_eq!([20, 21, 42].map(|samples| believed(&noise[..samples])), [0, 1, 2]);
    }
}
