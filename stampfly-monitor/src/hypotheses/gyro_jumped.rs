//! The gyro's zero jumps between two samples.
//!
//! A rate controller turns the body against the jump: after one of 1 rad/s the vehicle lies on its
//! side within a second. The camera's velocity diverges too late for that. At the jump itself the
//! cause is visible: a real rotation, from a blow or a manoeuvre, also appears in the image. The
//! image rate that neither rotation nor velocity explains is therefore compared before the jump and
//! over some readings after it.
//!
//! - **Above 0.15 m**: the zero has jumped if the image does not show the rotation.
//! - **Standing or leaving the floor**: if the image does not show the rotation, or the
//!   accelerometer measures no blow. Tilting about a leg leaves the image unchanged.
//! - **Elsewhere below 0.15 m**: never. A landing causes jumps, and a velocity error looks like a
//!   rotation.
//!
//! Not for a drifting zero, nor for the yaw rate, which the centre of the image does not show.

use crate::config::MonitorConfig;
use crate::evidence::Evidence;
use crate::hypothesis::{Hypothesis, Opinion, Sensor};
use stampfly_types::messages::{EstimateCorrection, Finding, ImuData};
use stampfly_types::{Duration, Instant, Stamped, Vec3, math};

/// Number of readings compared: 50 ms, in which a jump of 1 rad/s causes 3° of tilt. Twice as many
/// for a jump below `SMALL`, rad/s, whose ratio to the noise of a reading is smaller.
const READINGS: u32 = 5;
const SMALL: f32 = 0.6;
/// Time after which an examination with too few readings is dropped.
const PATIENCE: Duration = Duration::from_millis(170);
/// Time constant of the mean before a jump, s.
const BEFORE: f32 = 0.2;
/// Share of the jump that the image must miss along the direction of the jump, and may miss across
/// it. A reading of 10 ms has an error of 0.2 rad/s, and one with an extra frame 65 % of its rate.
const ALONG: core::ops::Range<f32> = 0.6..1.5;
const ACROSS: f32 = 0.6;
/// A jump happens within one sample: the changes before and after it are smaller than `FLAT` of it,
/// and together smaller than `RAMP` along it. Torque acts over the time constant of a motor and
/// makes a ramp.
const FLAT: f32 = 0.5;
const RAMP: f32 = 0.4;
/// Change of the specific force by a blow that turns a vehicle on its leg, m/s² per rad/s. The leg
/// is 3 cm away, and 3 cm/s in 2.5 ms are 12 m/s².
const FELT: f32 = 6.0;
/// Decay of the squared change per sample.
const BLOW_FADES: f32 = 0.6;
/// Time for which a reading shows that the vehicle stands or leaves the floor.
const LOW: Duration = Duration::from_millis(100);
/// Delay of a reading's frames before its stamp, in addition to its interval.
const LATE: Duration = Duration::from_millis(4);
/// Uncertain share of a jump after its correction.
const UNCERTAIN: f32 = 0.2;

/// A jump under examination.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Examination {
    since: Instant,
    jump: [f32; 2],
    /// A reckoner that runs throughout, and the estimate's velocity minus its own at the jump, m/s.
    reckoner: usize,
    apart: Vec3,
    sum: [f32; 2],
    readings: u32,
}

/// A confirmed jump: about body x and y, rad/s; its time; and the correction of the estimated
/// velocity for the camera's effect since then, world, m/s.
struct Found {
    jump: [f32; 2],
    since: Instant,
    velocity: Vec3,
}

/// Tests whether the gyro's zero jumps between two samples, by the image of the floor. Details are
/// at the head of the file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct GyroJumped {
    /// About body x and y, newest first, rad/s, and number of samples so far.
    rates: [[f32; 2]; 4],
    samples: u32,
    accel: Vec3,
    /// Largest squared change of the specific force between samples, over about the last four.
    blow: f32,
    /// Mean of the gyro rate that the image lacks, rad/s.
    before: [f32; 2],
    /// Time at which the vehicle last stood or was leaving the floor.
    low: Option<Instant>,
    examination: Option<Examination>,
}

impl Hypothesis for GyroJumped {
    const SENSOR: Sensor = Sensor::Gyro;
    const FINDING: Finding = Finding::Shifted;

    fn step(&mut self, config: &MonitorConfig, seen: &Evidence<'_>) -> Opinion {
        let found = self.flow(config, seen);
        let found = seen.samples.iter().fold(found, |found, sample| self.sample(config, seen, sample).or(found));
        let Some(Found { jump, since, velocity }) = found else { return Opinion::Unknown };
        // Remove the jump from the stored rates, so that it is not found again.
        let [a, b, ..] = self.rates;
        self.rates = [a, b, b, b];
        self.before = [self.before[0] + jump[0], self.before[1] + jump[1]];
        let rate = Vec3::new(jump[0], jump[1], 0.0);
        let turn = rate * -seen.now.since(since).seconds();
        Opinion::Holds(Some(EstimateCorrection {
            turn: seen.estimate.attitude.transform_vector(&turn),
            velocity: velocity.horizontal(),
            gyro_bias: rate,
            tilt_sigma: UNCERTAIN * turn.norm(),
            gyro_bias_sigma: UNCERTAIN * rate.norm(),
            velocity_sigma: config.velocity_sigma_m_s,
            ..EstimateCorrection::default()
        }))
    }
}

impl GyroJumped {
    /// Takes a sample. Returns a jump that can be confirmed without the image.
    fn sample(&mut self, config: &MonitorConfig, seen: &Evidence<'_>, sample: &Stamped<ImuData>) -> Option<Found> {
        let Stamped { at, data, .. } = sample;
        self.rates = [[data.gyro.x, data.gyro.y], self.rates[0], self.rates[1], self.rates[2]];
        self.samples = self.samples.saturating_add(1);
        let blow = (data.accel - self.accel).norm_squared();
        self.accel = data.accel;
        self.blow = math::larger(blow, self.blow * BLOW_FADES);
        if self.examination.is_some_and(|examination| at.since(examination.since) > PATIENCE) {
            self.examination = None;
        }
        if self.examination.is_some() || self.samples < 4 || !seen.trusts_samples {
            return None;
        }
        let [a, b, c, d] = self.rates;
        // Difference of the last two samples' mean and that of the two before.
        let jump = [0.5 * (a[0] + b[0] - c[0] - d[0]), 0.5 * (a[1] + b[1] - c[1] - d[1])];
        let size = squared(jump);
        let noise = config.gyro_jump_rms * config.gyro_jump_rms * seen.shaken[1];
        if size.is_nan() || size < config.gyro_jump_rad_s * config.gyro_jump_rad_s + noise {
            return None;
        }
        let [before, after] = [[c[0] - d[0], c[1] - d[1]], [a[0] - b[0], a[1] - b[1]]];
        let ramp = (before[0] + after[0]) * jump[0] + (before[1] + after[1]) * jump[1];
        if squared(before) + squared(after) > FLAT * FLAT * size || ramp > RAMP * size {
            return None;
        }
        // The middle between the second and the third newest sample at 400 Hz.
        let since = *at - Duration::from_micros(3_750);
        let is_low = self.low.is_some_and(|low| at.since(low) < LOW);
        if is_low && self.blow < FELT * FELT * size {
            return Some(Found { jump, since, velocity: Vec3::zeros() });
        }
        // The younger reckoner does not restart before the examination ends.
        let reckoner = 1 - seen.reckoners.older().min(1);
        let apart = seen.reckoners.apart(reckoner);
        self.examination = Some(Examination { since, jump, reckoner, apart, sum: [0.0; 2], readings: 0 });
        None
    }

    /// Takes a camera reading. Returns a jump that the image does not show.
    fn flow(&mut self, config: &MonitorConfig, seen: &Evidence<'_>) -> Option<Found> {
        let flow = seen.flow.as_ref()?;
        let leaves = self.low.is_some_and(|low| seen.now.since(low) < LOW);
        let near = flow.distance < config.flow_sharp_m;
        if seen.stands || (near && leaves) {
            self.low = Some(seen.now);
        }
        if (near && !seen.stands) || !seen.trusts_flow {
            self.examination = None;
            return None;
        }
        let Some(examination) = &mut self.examination else {
            let share = flow.interval / (BEFORE + flow.interval);
            for (mean, excess) in self.before.iter_mut().zip([flow.rate[1], -flow.rate[0]]) {
                *mean += (excess - *mean) * share;
            }
            return None;
        };
        // Velocity that the camera has added since the jump is not motion.
        let grown = seen.reckoners.apart(examination.reckoner) - examination.apart;
        let body = seen.estimate.attitude.inverse_transform_vector(&grown.horizontal());
        let excess = [flow.rate[1] + body.y / flow.distance, -flow.rate[0] - body.x / flow.distance];
        let from = seen.now - LATE - Duration::from_seconds(flow.interval);
        // Its frames were taken before the jump.
        if from < examination.since {
            return None;
        }
        examination.sum = [examination.sum[0] + excess[0], examination.sum[1] + excess[1]];
        examination.readings += 1;
        let needed = if squared(examination.jump) < SMALL * SMALL { 2 * READINGS } else { READINGS };
        if examination.readings < needed {
            return None;
        }
        let Examination { since, jump, sum, readings, .. } = *examination;
        self.examination = None;
        let share = 1.0 / readings as f32;
        let lacks = [sum[0] * share - self.before[0], sum[1] * share - self.before[1]];
        let scale = 1.0 / squared(jump);
        let along = (lacks[0] * jump[0] + lacks[1] * jump[1]) * scale;
        let across = (lacks[0] * jump[1] - lacks[1] * jump[0]) * scale;
        (ALONG.contains(&along) && across.abs() < ACROSS).then_some(Found { jump, since, velocity: -grown })
    }
}

fn squared([x, y]: [f32; 2]) -> f32 {
    x * x + y * y
}
