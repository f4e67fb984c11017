//! Separates the constant part of a receiver's position error from its noise.
//!
//! A receiver that states 1.5 m may be wrong by 1.5 m for a minute, and by half a metre differently
//! in each fix. Treated as 1.5 m of white noise, a hundred fixes would reduce the standard
//! deviation to 0.15 m, which is too small. The white part is observable: half the mean square
//! difference of successive fixes, less the motion in between. The rest of the stated variance is a
//! floor for the position variance: at the floor, a fix adds no information.
//!
//! | | condition |
//! |---|---|
//! | start | `position_wander`; until the differences are known, all of the error counts as constant |
//! | white | the differences explain most of the stated variance: no floor |
//! | first fix, and after [`PAUSE`] | new information: no floor, and no difference is taken |

use stampfly_types::{Duration, Instant, math};

/// Number of fixes in the mean: enough that white noise is not taken for half constant by chance.
const FIXES: f32 = 300.0;
/// Longest interval between two fixes over which the motion is known well enough.
const PAUSE: Duration = Duration::from_millis(2_500);
/// Share of the stated variance that the differences must explain to count as white: `WHITE`, less
/// `CHANCE` over the root of the number of differences, at least `LEAST_WHITE`.
const WHITE: f32 = 0.85;
const CHANCE: f32 = 2.5;
const LEAST_WHITE: f32 = 0.55;

/// Statistics of the fixes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Wander {
    last: Instant,
    /// Last fix minus the position after its update, m.
    residual: [f32; 3],
    /// Mean of half the squared differences, m², and their number.
    white: [f32; 3],
    differences: f32,
}

impl Wander {
    /// Takes a fix minus the estimated position before its update, m. Returns whether it follows
    /// another fix.
    pub(super) fn fix(&mut self, at: Instant, innovations: [f32; 3]) -> bool {
        let follows = self.last > Instant::ZERO && at.since(self.last) < PAUSE;
        if follows {
            self.differences = (self.differences + 1.0).min(FIXES);
            for ((white, residual), innovation) in self.white.iter_mut().zip(self.residual).zip(innovations) {
                // The motion since the last fix cancels: both values are relative to the estimate.
                let difference = innovation - residual;
                *white += (0.5 * difference * difference - *white) / self.differences;
            }
        }
        (self.last, self.residual) = (at, innovations);
        follows
    }

    /// Takes the change of the position by the update, m.
    pub(super) fn moved(&mut self, by: [f32; 3]) {
        for (residual, by) in self.residual.iter_mut().zip(by) {
            *residual -= by;
        }
    }

    /// Floor of the variance along one axis, m², for fixes of this stated variance.
    pub(super) fn floor(&self, axis: usize, variance: f32) -> f32 {
        let white = self.white.get(axis).copied().unwrap_or_default();
        let share = (WHITE - CHANCE / math::sqrt(self.differences.max(1.0))).max(LEAST_WHITE);
        if white < share * variance { variance - white } else { 0.0 }
    }
}

/// Measurement variance that leaves at least `floor` of the variance `prior`; at least `variance`.
pub(super) fn limited(prior: f32, variance: f32, floor: f32) -> f32 {
    // Posterior prior·v/(prior + v) = floor, solved for v. A larger noise variance leaves more than
    // the floor.
    let least = if prior > floor { prior * floor / (prior - floor) } else { f32::MAX };
    variance.max(least)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn a_measurement_leaves_the_floor_and_no_less() {
        let after = |prior: f32, variance: f32| prior * variance / (prior + variance);
        assert_abs_diff_eq!(after(4.0, limited(4.0, 0.1, 1.0)), 1.0, epsilon = 1e-5);
        assert_abs_diff_eq!(after(4.0, limited(4.0, 9.0, 1.0)), after(4.0, 9.0), epsilon = 1e-5);
        assert_eq!(limited(0.5, 0.1, 1.0), f32::MAX);
        assert_eq!(limited(0.5, 0.1, 0.0), 0.1);
    }

    #[test]
    fn white_noise_has_no_floor_and_an_error_that_stays_is_one() {
        let mut wander = Wander::default();
        assert_eq!(wander.floor(0, 4.0), 4.0, "until it is known");
        for n in 0..300u32 {
            let white = if n % 2 == 0 { 1.0 } else { -1.0 } * (1.0 + 0.3 * (n % 5) as f32);
            _ = wander.fix(Instant::from_millis(1_000 + u64::from(n) * 200), [white, 3.0, 3.0 + 0.2 * white]);
        }
        assert_eq!(wander.floor(0, 2.5), 0.0);
        assert_eq!(wander.floor(1, 9.0), 9.0);
        assert!(wander.floor(2, 9.0) > 8.5);
    }
}
