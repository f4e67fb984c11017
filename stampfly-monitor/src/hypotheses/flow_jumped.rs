//! Flow's velocity jumps.
//!
//! A body that changes its velocity by half a metre per second within a tenth of one feels it; an
//! offset that begins does not. What it leaves agrees with every motion that follows, so flow that
//! has jumped is not used again until the vehicle stands.
//!
//! Not for an offset that grows, which is slower.

use crate::config::MonitorConfig;
use crate::evidence::{Evidence, FlowReading};
use crate::hypothesis::{Hypothesis, Opinion, Sensor};
use crate::reckoner::Reckoner;
use stampfly_types::math;
use stampfly_types::messages::Finding;

/// Means of so many readings are compared with those two before: one of five holds two frames.
const BLOCK: u32 = 5;
/// From the first reading of the earlier mean to the last of the later one, s.
const SPAN: f32 = 0.15;
/// The velocity has to stay there for so long, s: what a late picture makes of a fast turn is over by
/// then, and a jump of the gyro's zero, which looks the same, is found and undone.
const WAITS: f32 = 0.1;

/// See the head of this file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FlowJumped {
    /// Against each reckoner: one of them has always lasted for longer than a jump.
    against: [Means; 2],
    /// Time since a jump, s.
    since: Option<f32>,
}

/// The last two means of [`BLOCK`] differences, and the sum of the next.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Means {
    means: [[f32; 2]; 2],
    sum: [f32; 2],
    /// Largest square of what single readings of each may be wrong by, (m/s)².
    uncertain: [f32; 3],
    readings: u32,
    /// Where it has jumped from, m/s, and what that was uncertain by, (m/s)².
    from: Option<([f32; 2], f32)>,
    /// Age of the reckoner, s.
    age: f32,
    /// Its variance by noise when the last three means began, oldest first, (m/s)².
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
                // As the filter has its tilt, and as the gyro's zero has moved it since.
                let tilted = (reckoner.tilted() + square(reckoner.drift())) * square(SPAN);
                let noise = square(config.gate_sigmas) * (means.walked(reckoner) + reckoner.aside() + tilted);
                means.step(index, flow, flow.uncertain + noise, limit);
                is_away |= means.from.is_some();
            }
            if !has_jumped {
                self.since = is_away.then(|| self.since.map_or(0.0, |time| time + flow.interval));
            }
        }
        // It jumped within the span of the means, before one of them was away.
        let ago = SPAN + self.since.unwrap_or_default();
        if has_jumped { Opinion::Holds(Some(seen.back_to(seen.last_before(ago)))) } else { Opinion::Unknown }
    }
}

impl Means {
    /// Variance of the velocity that noise has added up to since the first mean began, (m/s)².
    fn walked(&mut self, reckoner: &Reckoner) -> f32 {
        if reckoner.age < self.age {
            self.walk = [0.0; 3];
        }
        if self.readings.is_multiple_of(BLOCK) {
            self.walk = [self.walk[1], self.walk[2], reckoner.walk];
        }
        math::larger(reckoner.walk - self.walk[0], 0.0)
    }

    /// Takes a reading. A mean that is away from an earlier one by more than `limit`, m/s, beyond what is
    /// uncertain, (m/s)², has jumped from there, until one is not.
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
        // Before the third mean there is nothing to compare with.
        let before = self.from.or((self.readings >= 3 * BLOCK).then_some((first, uncertain)));
        self.from = before.filter(|(before, was)| {
            let [x, y] = [mean[0] - before[0], mean[1] - before[1]];
            x * x + y * y > limit * limit + math::larger(*was, uncertain)
        });
    }
}
