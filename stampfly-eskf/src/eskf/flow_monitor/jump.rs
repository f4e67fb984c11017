//! Does flow's velocity jump?
//!
//! No body changes its velocity by half a metre per second in a tenth of one; an offset that begins does. What it leaves agrees
//! with every motion that follows, so flow that has jumped is not believed again until the vehicle stands. Not for an offset
//! that grows: that is the slower comparison's.

use super::picture::SHARP;

/// Means of so many readings are compared with those two before: one of five holds two frames.
const BLOCK: u32 = 5;
/// Largest jump of such a mean, m/s, and for each metre of distance: 1 m/s² over 0.15 s, and the picture's noise.
const JUMP: f32 = 0.2;
const PER_METRE: f32 = 0.5;
/// A jump convicts flow after this time, s: one of the gyro's zero looks the same, and is found and undone until then.
const WAITS: f32 = 0.1;

/// The last two means of [`BLOCK`] differences, and the sum of the next.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Jump {
    means: [[f32; 2]; 2],
    sum: [f32; 2],
    /// Largest square of what single readings of each may be wrong by, m²/s².
    uncertain: [f32; 3],
    readings: u32,
    /// Time since a jump, s, while it is none of the gyro's.
    since: Option<f32>,
}

impl Jump {
    /// Takes how far apart flow's velocity and the accelerometer's are, m/s. `uncertain`: square of what single readings and
    /// vibration may be wrong by, m²/s². Where the filter is not sure of itself, `sure` is false.
    pub(super) fn step(&mut self, apart: [f32; 2], distance: f32, uncertain: f32, interval: f32, sure: bool) {
        for (sum, apart) in self.sum.iter_mut().zip(apart) {
            *sum += apart / BLOCK as f32;
        }
        self.readings = self.readings.wrapping_add(1);
        let [before, last, now] = self.uncertain;
        self.uncertain = [before, last, now.max(uncertain)];
        let uncertain = self.uncertain.into_iter().fold(0.0, f32::max);
        let (jump, limit) = (self.jump(), JUMP + PER_METRE * distance);
        let jumps = distance > SHARP && sure && jump > limit * limit + uncertain;
        self.since = self.since.map(|time| time + interval).or(jumps.then_some(0.0));
    }

    /// Square of the jump that a mean has made since the one two before, m²/s²; zero between blocks.
    fn jump(&mut self) -> f32 {
        if !self.readings.is_multiple_of(BLOCK) {
            return 0.0;
        }
        let mean = core::mem::take(&mut self.sum);
        let [before, last] = self.means;
        self.means = [last, mean];
        let [_, second, third] = self.uncertain;
        self.uncertain = [second, third, 0.0];
        let [x, y] = [mean[0] - before[0], mean[1] - before[1]];
        // Before the third block there is nothing to compare with.
        if self.readings < 3 * BLOCK { 0.0 } else { x * x + y * y }
    }

    /// Has it jumped?
    pub(super) fn has_jumped(&self) -> bool {
        self.since > Some(WAITS)
    }

    /// What was compared until now says nothing. What has convicted stays.
    pub(super) fn forget(&mut self) {
        *self = Self { since: self.since.filter(|_| self.has_jumped()), ..Self::default() };
    }
}
