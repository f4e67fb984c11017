//! The gyro's zero jumps from one sample to the next.
//!
//! Whoever controls the rate turns the body the other way: after a jump of 1 rad/s it lies on its side
//! within a second. Until the camera's velocity has grown apart it is too late. At the jump itself it
//! is clear whose it is: what a blow or a manoeuvre turns shows in the picture, too. So the rate of
//! the picture that neither turning nor velocity explains is compared, before the jump and over some
//! readings from then on.
//!
//! | where | the gyro's zero has jumped when |
//! |---|---|
//! | above 0.15 m | the picture does not share it |
//! | standing, or leaving the floor | the picture does not share it, or no blow is felt with it: a tilt about a leg leaves the picture where it is |
//! | elsewhere below 0.15 m | never: landing makes jumps, and an error of the velocity looks like a rate |
//!
//! Not for a zero that drifts, nor for the yaw rate, which a picture in its middle does not show.

use crate::config::MonitorConfig;
use crate::evidence::Evidence;
use crate::hypothesis::{Hypothesis, Opinion, Sensor};
use stampfly_types::messages::{EstimateCorrection, Finding, ImuData};
use stampfly_types::{Duration, Instant, Stamped, Vec3, math};

/// Readings that are compared: 50 ms, in which a jump of 1 rad/s makes a tilt of 3°, and twice
/// as many for a jump that is smaller than this, rad/s: its share of a reading's noise is larger.
const READINGS: u32 = 5;
const SMALL: f32 = 0.6;
/// If there are not as many after this time, nothing is found.
const PATIENCE: Duration = Duration::from_millis(170);
/// Time constant of the mean before a jump, s.
const BEFORE: f32 = 0.2;
/// Share of the jump that the picture has to lack along the jump's direction, and may lack across: a
/// reading of 10 ms is uncertain by 0.2 rad/s, and one that holds a frame too much by 65 % of its rate.
const ALONG: core::ops::Range<f32> = 0.6..1.5;
const ACROSS: f32 = 0.6;
/// A jump happens within a sample: the changes before and after it are smaller than this share of it,
/// and do not make as much of it together, along it. Torque takes a motor's time and makes a ramp.
const FLAT: f32 = 0.5;
const RAMP: f32 = 0.4;
/// A blow that turns a vehicle on a leg changes the specific force by more than this for each rad/s,
/// m/s²: the leg is 3 cm away, and 3 cm/s in 2.5 ms are 12 m/s².
const FELT: f32 = 6.0;
/// Its square fades by this with each sample.
const BLOW_FADES: f32 = 0.6;
/// Readings keep telling that it stands or leaves the floor, one in this time.
const LOW: Duration = Duration::from_millis(100);
/// How long before the stamp of a reading its pictures were taken, beside its interval.
const LATE: Duration = Duration::from_millis(4);
/// Share of the jump that stays uncertain.
const UNCERTAIN: f32 = 0.2;

/// A jump that is being examined.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Examination {
    since: Instant,
    jump: [f32; 2],
    /// A reckoner that goes on meanwhile, and the estimate's velocity less its at the jump, m/s.
    reckoner: usize,
    apart: Vec3,
    sum: [f32; 2],
    readings: u32,
}

/// A jump that was the gyro's own: about body x and y, rad/s, when it happened, and what to add to the
/// estimated velocity to be without the camera's part since, world, m/s.
struct Found {
    jump: [f32; 2],
    since: Instant,
    velocity: Vec3,
}

/// See the head of this file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct GyroJumped {
    /// About body x and y, newest first, rad/s, and how many there are.
    rates: [[f32; 2]; 4],
    samples: u32,
    accel: Vec3,
    /// Largest square of a change of the specific force between samples, over the last four or so.
    blow: f32,
    /// Mean of what the picture lacks of the gyro's rate, rad/s.
    before: [f32; 2],
    /// When it last stood, or was leaving the floor.
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
        // It is not found again.
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
    /// Takes a sample. Gives a jump and when it happened, where the picture need not be asked.
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
        // Of the last two to the two before.
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
        let since = *at - Duration::from_micros(3_750);
        let is_low = self.low.is_some_and(|low| at.since(low) < LOW);
        if is_low && self.blow < FELT * FELT * size {
            return Some(Found { jump, since, velocity: Vec3::zeros() });
        }
        // The younger one does not begin anew before it is over.
        let reckoner = 1 - seen.reckoners.older().min(1);
        let apart = seen.reckoners.apart(reckoner);
        self.examination = Some(Examination { since, jump, reckoner, apart, sum: [0.0; 2], readings: 0 });
        None
    }

    /// Takes a reading of the camera. Gives a jump that it does not share, and when it happened.
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
        // What the camera has done to the velocity since is no motion.
        let grown = seen.reckoners.apart(examination.reckoner) - examination.apart;
        let body = seen.estimate.attitude.inverse_transform_vector(&grown.horizontal());
        let excess = [flow.rate[1] + body.y / flow.distance, -flow.rate[0] - body.x / flow.distance];
        let from = seen.now - LATE - Duration::from_seconds(flow.interval);
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
