//! Garbage among the inertial samples: a shifted frame, a register of `0x8000`, spikes.
//!
//! A sample that [`ImuData::is_garbled`] recognises is replaced by the last one before it, for at most three samples running:
//! what goes on is no glitch. Integrating one such sample costs more than standing in for it: 8 g for 2.5 ms are
//! 0.2 m/s and the tilt of 2000 °/s is 5°.

use crate::config::EskfConfig;
use stampfly_types::Instant;
use stampfly_types::messages::ImuData;

/// Samples running that are bridged.
const LONGEST: u32 = 3;

/// The last sample that was believed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Bridge {
    last: Option<(Instant, ImuData)>,
    bridged: u32,
}

impl Bridge {
    /// What to use in place of a finite sample; `None` for the sample itself.
    pub(super) fn step(&mut self, config: &EskfConfig, at: Instant, imu: &ImuData) -> Option<ImuData> {
        let stand_in = self.last.filter(|(last, before)| {
            let before = Some((at.since(*last), before.gyro));
            self.bridged < LONGEST && imu.is_garbled(before, config.angular_acceleration, config.accel_full_scale)
        });
        if let Some((_, before)) = stand_in {
            self.bridged += 1;
            return Some(before);
        }
        self.bridged = 0;
        self.last = Some((at, *imu));
        None
    }
}
