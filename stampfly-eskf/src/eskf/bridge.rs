//! Garbage among the inertial samples: a shifted frame, a register of `0x8000`, spikes.
//!
//! A sample that [`ImuData::is_garbled`] recognises is replaced by the last one that was believed.
//! What goes on is no glitch: the fourth sample running is believed if it follows from the one
//! before it as a body moves, and the first after 50 ms whatever it is: for so long a vehicle flies
//! on with its last rates. Spikes that happen to come together do not follow from each other.
//! Integrating one such sample costs more than standing in for it: 8 g for 2.5 ms are 0.2 m/s and
//! the tilt of 2000 °/s is 5°.

use crate::config::EskfConfig;
use stampfly_types::messages::ImuData;
use stampfly_types::{Instant, Vec3};

/// Garbled samples running that are bridged: of those that follow from each other, and of any.
const FOLLOWING: u32 = 3;
const LONGEST: u32 = 20;

/// The last sample that was believed, and the garbled ones since.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Bridge {
    last: Option<(Instant, ImuData)>,
    /// Rate of the last garbled sample.
    garbled: Vec3,
    /// Garbled samples running, and how many of them follow from each other.
    bridged: u32,
    following: u32,
}

impl Bridge {
    /// What to use in place of a finite sample; `None` for the sample itself.
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
                    // As if it had been measured now: what is allowed to the next sample does not grow with a burst.
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

    /// Samples of a body at rest, with these rates about x and y at the end; how many of them were believed.
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
        // None of them follows from the one before, nor any from the first that is believed.
        let others = [[-20.0, 0.0], [0.0, 20.0], [0.0, -20.0]];
        let noise: [[f32; 2]; 42] = core::array::from_fn(|n| if n == 20 { [20.0, 0.0] } else { others[n % 3] });
        assert_eq!([20, 21, 42].map(|samples| believed(&noise[..samples])), [0, 1, 2]);
    }
}
