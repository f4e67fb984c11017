//! The gyro's zero has shifted while the vehicle stands.
//!
//! A body that turns moves gravity through its axes. Over quarters of a second the rotation
//! measured by the gyro is compared with that of gravity. If the gyro turns and gravity does not,
//! the zero has shifted. The estimate's attitude is not usable for this test: gravity pulls it
//! back, and an accelerometer bias looks the same.
//!
//! Gravity does not show rotation about the vertical, so the z axis is excluded. A vehicle that is
//! carried moves both and is not tested.

use crate::config::MonitorConfig;
use crate::evidence::Evidence;
use crate::hypothesis::{Hypothesis, Opinion, Sensor};
use stampfly_types::messages::{EstimateCorrection, Finding, ImuData};
use stampfly_types::{GRAVITY, Instant, Stamped, Vec3};

/// Length of the compared means, s.
const WINDOW: f32 = 0.25;
/// Largest rotation of gravity as a share of the shift; more means that the vehicle is moved by
/// hand. Also the largest difference between two successive comparisons.
const STILL: f32 = 0.3;
/// Uncertain share of the shift after its correction.
const UNCERTAIN: f32 = 0.1;
/// Standard deviation of the tilt by gravity alone, rad: an accelerometer bias of 0.3 m/s².
const TILT_SIGMA: f32 = 0.03;
/// Upper bound on the interval between samples, s.
const LONGEST_STEP: f32 = 0.05;

/// Means over a window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Means {
    elapsed: f32,
    samples: f32,
    accel: Vec3,
    rate: Vec3,
}

/// Tests whether the gyro turns on the ground while gravity does not. Details are at the head of
/// the file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct GyroStanding {
    last: Option<Instant>,
    /// The last window and the one being filled.
    before: Option<Means>,
    now: Means,
    /// Result of the last comparison, rad/s.
    found: Option<[f32; 2]>,
}

impl GyroStanding {
    /// Takes a sample. Returns a shift about body x and y, rad/s, on which two comparisons agree.
    fn sample(&mut self, sample: &Stamped<ImuData>, bias: &Vec3, smallest: f32) -> Option<[f32; 2]> {
        let Stamped { at, data, .. } = sample;
        let last = self.last.replace(*at).unwrap_or(*at);
        self.now.elapsed += at.since(last).seconds().min(LONGEST_STEP);
        self.now.samples += 1.0;
        self.now.accel += data.accel;
        self.now.rate += data.gyro - *bias;
        if self.now.elapsed < WINDOW {
            return None;
        }
        let window = core::mem::take(&mut self.now);
        let share = 1.0 / window.samples;
        let now = Means { accel: window.accel * share, rate: window.rate * share, ..window };
        let before = self.before.replace(now)?;
        let found = excess(&before, &now, smallest);
        let last = core::mem::replace(&mut self.found, found);
        let (rate, last) = found.zip(last)?;
        let differs = squared([rate[0] - last[0], rate[1] - last[1]]);
        (differs < STILL * STILL * squared(rate)).then_some(rate)
    }
}

impl Hypothesis for GyroStanding {
    const SENSOR: Sensor = Sensor::Gyro;
    const FINDING: Finding = Finding::Shifted;

    fn step(&mut self, config: &MonitorConfig, seen: &Evidence<'_>) -> Opinion {
        if !seen.stands {
            *self = Self::default();
            return Opinion::Unknown;
        }
        for sample in seen.samples {
            let Some([x, y]) = self.sample(sample, &seen.estimate.gyro_bias, config.gyro_standing_rad_s) else {
                continue;
            };
            let force = self.before.map_or(Vec3::zeros(), |before| before.accel);
            *self = Self::default();
            // Level the attitude by gravity, as at power-on.
            let up = seen.estimate.attitude.inverse_transform_vector(&Vec3::new(0.0, 0.0, -1.0));
            let turn = force.cross(&up) / force.norm().max(1.0);
            let shift = Vec3::new(x, y, 0.0);
            return Opinion::Holds(Some(EstimateCorrection {
                turn: seen.estimate.attitude.transform_vector(&Vec3::new(turn.x, turn.y, 0.0)),
                gyro_bias: shift,
                // The shift's effect on the attitude has also entered the accelerometer bias.
                accel_bias: -seen.estimate.accel_bias.horizontal(),
                tilt_sigma: TILT_SIGMA,
                gyro_bias_sigma: UNCERTAIN * shift.norm(),
                ..EstimateCorrection::default()
            }));
        }
        Opinion::Unknown
    }
}

/// Rotation of the gyro minus that of gravity about body x and y, rad/s, if only the gyro turns.
fn excess(before: &Means, now: &Means, smallest: f32) -> Option<[f32; 2]> {
    // A rate w about x and y moves gravity, which points along −z, by g·(w.y, −w.x) per second.
    let per_second = (now.accel - before.accel) / (GRAVITY * 0.5 * (before.elapsed + now.elapsed));
    let gravity = [-per_second.y, per_second.x];
    let rate = (before.rate + now.rate) * 0.5;
    let shift = [rate.x - gravity[0], rate.y - gravity[1]];
    let alone = squared(shift) > smallest * smallest && squared(gravity) < STILL * STILL * squared(shift);
    alone.then_some(shift)
}

fn squared([x, y]: [f32; 2]) -> f32 {
    x * x + y * y
}
