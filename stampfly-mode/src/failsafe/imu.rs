//! Does the inertial sensor measure? A sensor that has died may go on delivering: the same sample, zeros, full scale.
//!
//! | it does not measure when | after |
//! |---|---|
//! | one axis repeats the same number | `stuck_samples`: noise of a MEMS sensor forbids it |
//! | one axis stays at full scale | `stuck_samples` |
//! | most samples ask for an angular acceleration that no body has ([`motion`](super::motion)) | 24 of them in a row, or as many of 27 |
//! | the mean specific force is far from gravity, in a mode that holds its height | `force_time` |
//!
//! Samples that are not finite never get here: they count as silence. Not for small errors of scale and bias, which
//! the estimator finds.

use super::config::FailsafeConfig;
use crate::lasting::lasts;
use stampfly_types::messages::ImuData;
use stampfly_types::{Instant, Vec3};

/// Suspect samples count this much against one that is not.
const SUSPECT: u32 = 8;
/// Where they are a fault: 24 running, which is 60 ms at 400 Hz.
const SUSPECTS: u32 = 24 * SUSPECT;
/// Share of full scale that counts as full scale: calibration and the decimation filter move it.
const FULL: f32 = 0.98;

/// What is remembered of the samples.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct ImuMonitor {
    last: [f32; 6],
    /// Samples running in which each axis repeated itself, and in which it was at full scale.
    equal: [u32; 6],
    full: [u32; 6],
    suspects: u32,
    mean: Option<Vec3>,
    off: Option<Instant>,
}

impl ImuMonitor {
    /// Takes a sample. `suspect` says that it asks for the impossible, `holds_height` that the vehicle flies in a mode
    /// whose climb rate is limited. True while the sensor does not measure.
    pub(super) fn step(
        &mut self,
        config: &FailsafeConfig,
        at: Instant,
        imu: &ImuData,
        suspect: bool,
        holds_height: bool,
    ) -> bool {
        let [accel, gyro] = [config.accel_full_scale * FULL, config.gyro_full_scale * FULL];
        let [ax, ay, az] = imu.accel.into();
        let [gx, gy, gz] = imu.gyro.into();
        let values = [(ax, accel), (ay, accel), (az, accel), (gx, gyro), (gy, gyro), (gz, gyro)];
        let mut worst = 0;
        let counts = self.equal.iter_mut().zip(&mut self.full);
        for (((value, limit), last), (equal, full)) in values.into_iter().zip(&mut self.last).zip(counts) {
            let count = |run: &mut u32, holds: bool| *run = if holds { run.saturating_add(1) } else { 0 };
            count(equal, value.to_bits() == last.to_bits());
            count(full, value.abs() >= limit);
            *last = value;
            worst = worst.max(*equal).max(*full);
        }
        self.suspects =
            if suspect { (self.suspects + SUSPECT).min(2 * SUSPECTS) } else { self.suspects.saturating_sub(1) };
        let mean = self.mean.get_or_insert(imu.accel);
        *mean += (imu.accel - *mean) * config.force_weight;
        let [low, high] = config.force_range;
        let off = holds_height && !(low * low..=high * high).contains(&mean.norm_squared());
        let off = lasts(&mut self.off, at, off, config.force_time);
        worst >= config.stuck_samples || self.suspects >= SUSPECTS || off
    }
}
