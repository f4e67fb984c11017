//! Garbage among the inertial samples: a shifted frame, a register of `0x8000`, spikes.
//!
//! A body with a moment of inertia does not change its rate by more than its torque allows. A sample that asks for more,
//! or whose accelerometer has every axis at full scale, is replaced by the last one before it, for at most three samples
//! running: what goes on is no glitch. Integrating one such sample costs more than standing in for it: 8 g for 2.5 ms are
//! 0.2 m/s and the tilt of 2000 °/s is 5°.

use crate::config::EskfConfig;
use stampfly_types::messages::ImuData;
use stampfly_types::{Duration, Instant};

/// Samples running that are bridged.
const LONGEST: u32 = 3;
/// Share of full scale that counts as full scale.
const FULL: f32 = 0.9;
/// After a gap this long nothing is known about what the rate was.
const GAP: Duration = Duration::from_millis(50);
/// Two samples that came together are a period apart, this long at least.
const PERIOD: Duration = Duration::from_millis(2);
/// A body whose samples are missing for longer goes on as it did: only a blow changes its rate by more.
const STEADY: Duration = Duration::from_millis(5);

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
            let elapsed = at.since(*last);
            let limit = config.angular_acceleration * elapsed.clamp(PERIOD, STEADY).seconds();
            let jumps = (imu.gyro - before.gyro).iter().any(|change| change.abs() > limit);
            let full = imu.accel.iter().all(|axis| axis.abs() > FULL * config.accel_full_scale);
            elapsed < GAP && (jumps || full) && self.bridged < LONGEST
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
