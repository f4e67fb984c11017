//! The flow velocity jumps.
//!
//! The accelerometer measures a real change of velocity by half a metre per second within a tenth
//! of a second, but not an offset that begins. With an offset flow still agrees with all later
//! motion, so it is not used again until the vehicle stands.
//!
//! Not for an offset that grows slowly.

use crate::config::MonitorConfig;
use crate::evidence::{Evidence, FlowReading};
use crate::hypothesis::{Hypothesis, Opinion, Sensor};
use crate::reckoner::Reckoner;
use stampfly_types::math;
use stampfly_types::messages::Finding;

/// Number of readings per mean. One reading in five holds two frames, so each mean contains one
/// of them. A mean is compared with the one before the last.
const BLOCK: u32 = 5;
/// Time from the first reading of the earlier mean to the last of the later one, s.
const SPAN: f32 = 0.15;
/// Time for which the velocity must stay changed, s. A late frame in a fast turn is over by then,
/// and a jump of the gyro's zero, which looks the same, has been found and corrected.
const WAITS: f32 = 0.1;

/// Tests whether the flow velocity jumps without a measured acceleration. Details are at the head
/// of the file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FlowJumped {
    /// One per reckoner, because one of them is always older than a jump.
    against: [Means; 2],
    /// Time since the jump, s.
    since: Option<f32>,
}

/// The last two means of [`BLOCK`] differences, and the sum of the next one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Means {
    means: [[f32; 2]; 2],
    sum: [f32; 2],
    /// Largest variance of single readings in each, (m/s)².
    uncertain: [f32; 3],
    readings: u32,
    /// Velocity before the jump, m/s, and its variance, (m/s)².
    from: Option<([f32; 2], f32)>,
    /// Age of the reckoner, s.
    age: f32,
    /// Noise variance of the reckoner at the start of the last three means, oldest first, (m/s)².
    walk: [f32; 3],
}

impl Hypothesis for FlowJumped {
    const SENSOR: Sensor = Sensor::Flow;
    const FINDING: Finding = Finding::Jumped;

    fn step(&mut self, config: &MonitorConfig, seen: &Evidence<'_>) -> Opinion {
        if seen.stands {
            *self = Self::default();
        }
        let Some(flow) = seen.flow.as_ref().filter(|_| !seen.stands) else { return Opinion::Unknown };
        let has_jumped = self.since > Some(WAITS);
        if !flow.comparable || !seen.settled || flow.distance < config.flow_sharp_m {
            *self = Self { since: self.since.filter(|_| has_jumped), ..Self::default() };
        } else {
            let square = |value: f32| value * value;
            let limit = config.flow_jump_m_s + config.flow_jump_rad_s * flow.distance;
            let mut is_away = false;
            for (index, means) in self.against.iter_mut().enumerate() {
                let reckoner = seen.reckoners.get(index);
                // The initial tilt error and the effect of the gyro bias since then.
                let tilted = (reckoner.tilted() + square(reckoner.drift())) * square(SPAN);
                let noise = square(config.gate_sigmas) * (means.walked(reckoner) + reckoner.aside() + tilted);
                means.step(index, flow, flow.uncertain + noise, limit);
                is_away |= means.from.is_some();
            }
            if !has_jumped {
                self.since = is_away.then(|| self.since.map_or(0.0, |time| time + flow.interval));
            }
        }
        // The jump happened up to one span before it was visible in a mean.
        let ago = SPAN + self.since.unwrap_or_default();
        if has_jumped { Opinion::Holds(Some(seen.back_to(seen.last_before(ago)))) } else { Opinion::Unknown }
    }
}

impl Means {
    /// Variance accumulated from noise since the start of the first mean, (m/s)².
    fn walked(&mut self, reckoner: &Reckoner) -> f32 {
        if reckoner.age < self.age {
            self.walk = [0.0; 3];
        }
        if self.readings.is_multiple_of(BLOCK) {
            self.walk = [self.walk[1], self.walk[2], reckoner.walk];
        }
        math::larger(reckoner.walk - self.walk[0], 0.0)
    }

    /// Takes a reading. A mean has jumped if it differs from an earlier one by more than `limit`,
    /// m/s, and the variance `uncertain`, (m/s)²; the jump ends when a later mean does not.
    fn step(&mut self, index: usize, flow: &FlowReading, uncertain: f32, limit: f32) {
        let age = flow.ages.get(index).copied().unwrap_or_default();
        if age < core::mem::replace(&mut self.age, age) {
            *self = Self { age, ..Self::default() };
        }
        let apart = flow.apart.get(index).copied().unwrap_or_default();
        for (sum, apart) in self.sum.iter_mut().zip(apart) {
            *sum += apart / BLOCK as f32;
        }
        self.readings = self.readings.saturating_add(1);
        let [before, last, now] = self.uncertain;
        self.uncertain = [before, last, math::larger(now, uncertain)];
        if !self.readings.is_multiple_of(BLOCK) {
            return;
        }
        let mean = core::mem::take(&mut self.sum);
        let [first, second] = self.means;
        self.means = [second, mean];
        let uncertain = self.uncertain.into_iter().fold(0.0, math::larger);
        let [_, last, now] = self.uncertain;
        self.uncertain = [last, now, 0.0];
        // The first comparison is possible with the third mean.
        let before = self.from.or((self.readings >= 3 * BLOCK).then_some((first, uncertain)));
        self.from = before.filter(|(before, was)| {
            let [x, y] = [mean[0] - before[0], mean[1] - before[1]];
            x * x + y * y > limit * limit + math::larger(*was, uncertain)
        });
    }
}
