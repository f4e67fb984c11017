//! How much of a receiver's error stays the same from fix to fix?
//!
//! A receiver that says 1.5 m is wrong by 1.5 m for a minute, and by half a metre differently in each fix. Taken for 1.5 m of white
//! noise, a hundred fixes would make 0.15 m of it, which nobody knows. The white part shows: it is half of the mean square by which
//! a fix differs from the one before, less the way in between. What the stated variance has beyond it, is a floor under the
//! variance of the position: below it a fix tells nothing.
//!
//! | | condition |
//! |---|---|
//! | start | `position_wander`; until fixes have shown that they differ, all of the error stays |
//! | white | the differences explain most of the stated variance: no floor |
//! | first, and after [`PAUSE`] | such a fix is news: no floor, and no difference to look at |

use stampfly_types::{Duration, Instant, math};

/// Fixes over which the mean is taken: long enough that chance does not take white noise for half of it.
const FIXES: f32 = 300.0;
/// The way in between is known over so long.
const PAUSE: Duration = Duration::from_millis(2_500);
/// Share of the stated variance that the differences have to explain: so much less than all of it as chance takes from a mean of so
/// many fixes, over their root; and never less than a half.
const WHITE: f32 = 0.85;
const CHANCE: f32 = 2.5;
const LEAST_WHITE: f32 = 0.55;

/// What fixes have shown of their errors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Wander {
    last: Instant,
    /// The last fix less the position after it, m.
    residual: [f32; 3],
    /// Mean squares of half the differences, m², and of how many.
    white: [f32; 3],
    differences: f32,
}

impl Wander {
    /// Takes a fix less the estimated position before it, m. Does it follow another one?
    pub(super) fn fix(&mut self, at: Instant, innovations: [f32; 3]) -> bool {
        let follows = self.last > Instant::ZERO && at.since(self.last) < PAUSE;
        if follows {
            self.differences = (self.differences + 1.0).min(FIXES);
            for ((white, residual), innovation) in self.white.iter_mut().zip(self.residual).zip(innovations) {
                let difference = innovation - residual;
                *white += (0.5 * difference * difference - *white) / self.differences;
            }
        }
        (self.last, self.residual) = (at, innovations);
        follows
    }

    /// The position has moved by this, m, since the fix was compared with it.
    pub(super) fn moved(&mut self, by: [f32; 3]) {
        for (residual, by) in self.residual.iter_mut().zip(by) {
            *residual -= by;
        }
    }

    /// Floor under the variance along one axis, m², for fixes of this variance.
    pub(super) fn floor(&self, axis: usize, variance: f32) -> f32 {
        let white = self.white.get(axis).copied().unwrap_or_default();
        let share = (WHITE - CHANCE / math::sqrt(self.differences.max(1.0))).max(LEAST_WHITE);
        if white < share * variance { variance - white } else { 0.0 }
    }
}

/// Variance with which a measurement leaves at least `floor` of a variance; of noise `variance` otherwise.
pub(super) fn limited(prior: f32, variance: f32, floor: f32) -> f32 {
    // prior·v/(prior + v) = floor; above, the noise itself leaves more.
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
