//! Does the inertial sensor measure? A sensor that has died may go on delivering: the same sample, zeros, full scale.
//!
//! | it does not measure when | after |
//! |---|---|
//! | one axis repeats the same number | `stuck_samples`: noise of a MEMS sensor forbids it |
//! | one axis stays at full scale | `stuck_samples` |
//! | many samples ask for an angular acceleration that no body has ([`motion`](super::motion)) | 21 of them in a row, or 42 of 84 |
//!
//! The first two are told apart for gyro and accelerometer: without the first a vehicle does not fly, without the second
//! it lands. With fewer such samples as in the third row, but six close together or more than one in 25, the sensor is
//! *noisy*: the vehicle can still fly, and lands.
//!
//! Samples that are not finite never get here: they count as silence. Not for small errors of scale and bias, which
//! the estimator finds.

use super::config::FailsafeConfig;
use stampfly_types::Vec3;
use stampfly_types::messages::ImuData;

/// Suspect samples count this much against one that is not: a third of them adds up.
const SUSPECT: u32 = 2;
/// Where they are a fault: the first beyond 50 ms at 400 Hz. Until then the vehicle flies on with
/// its last rates. A disturbance of four fifths of its authority, which nothing meets for 50 ms and
/// the rest then brakes, turns a vehicle of a palm's size, 330 rad/s², by 262·0.05²/2·5 rad: a
/// quarter of a turn, from which it levels.
const SUSPECTS: u32 = 21 * SUSPECT;
/// The same for noise: one sample in 25 adds up.
const NOISE: u32 = 24;
/// Where they are noise: three more than a garbled burst has.
const NOISY: u32 = 6 * NOISE;
/// Share of full scale that counts as full scale: calibration and the decimation filter move it.
const FULL: f32 = 0.98;

/// What is remembered of one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Axis {
    last: f32,
    /// Samples running in which it repeated itself, and in which it was at full scale.
    equal: u32,
    full: u32,
}

impl Axis {
    /// Takes a value; gives the longer of the two runs.
    fn step(&mut self, value: f32, full: f32) -> u32 {
        let count = |run: u32, holds: bool| if holds { run.saturating_add(1) } else { 0 };
        self.equal = count(self.equal, value.to_bits() == self.last.to_bits());
        self.full = count(self.full, value.abs() >= full);
        self.last = value;
        self.equal.max(self.full)
    }
}

/// What is remembered of the samples.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct ImuMonitor {
    accel: [Axis; 3],
    gyro: [Axis; 3],
    /// The longest run of each.
    accel_runs: u32,
    gyro_runs: u32,
    suspects: u32,
    noise: u32,
}

/// What the samples say about the sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct ImuVerdict {
    /// It does not measure, or its gyro does not.
    pub faulty: bool,
    /// Its accelerometer does not measure.
    pub accel_faulty: bool,
    /// Some of its samples are garbage.
    pub noisy: bool,
}

impl ImuMonitor {
    /// Takes a sample. `suspect`: it implies an angular acceleration that no body has.
    pub(super) fn step(&mut self, config: &FailsafeConfig, imu: &ImuData, suspect: bool) -> ImuVerdict {
        // Garbage has a count of its own.
        if !suspect {
            self.accel_runs = longest(&mut self.accel, &imu.accel, config.accel_full_scale);
            self.gyro_runs = longest(&mut self.gyro, &imu.gyro, config.gyro_full_scale);
        }
        let count = |count: u32, weight: u32, limit: u32| {
            if suspect { (count + weight).min(limit) } else { count.saturating_sub(1) }
        };
        self.suspects = count(self.suspects, SUSPECT, 2 * SUSPECTS);
        self.noise = count(self.noise, NOISE, 2 * NOISY);
        ImuVerdict {
            faulty: self.gyro_runs >= config.stuck_samples || self.suspects >= SUSPECTS,
            accel_faulty: self.accel_runs >= config.stuck_samples,
            noisy: self.noise >= NOISY,
        }
    }
}

/// The longest run of a sensor's axes, this sample included.
fn longest(axes: &mut [Axis; 3], values: &Vec3, full_scale: f32) -> u32 {
    axes.iter_mut()
        .zip(values.to_array())
        .fold(0, |longest, (axis, value)| longest.max(axis.step(value, full_scale * FULL)))
}
