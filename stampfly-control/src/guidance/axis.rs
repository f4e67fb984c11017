//! One coordinate that moves with bounded speed, acceleration and jerk.
//!
//! Each step chooses the acceleration at its end. Towards a speed, that choice has a closed form. Towards a place, it
//! is the acceleration from which a stop with the same bounds would end exactly there: the farthest reachable by
//! full jerk while there is room, then the one on the braking curve. Nothing is planned ahead, so the goal and the
//! bounds may change at any step, in any state of motion. An axis that starts within its bounds stays within them and
//! never passes a goal it could stop at; one that starts beyond them (bounds were lowered) is brought back with
//! bounded jerk.

use stampfly_types::math;

use crate::bound::{symmetric, within};

/// Bounds of motion along one axis; all positive.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Bounds {
    /// Largest speed, per second.
    pub speed: f32,
    /// Largest acceleration, per second².
    pub acceleration: f32,
    /// Largest jerk, per second³.
    pub jerk: f32,
}

impl Bounds {
    /// The same motion on a shorter scale: all bounds times `share`.
    #[must_use]
    pub fn scaled(&self, share: f32) -> Self {
        Self { speed: self.speed * share, acceleration: self.acceleration * share, jerk: self.jerk * share }
    }
}

/// The state of motion along one axis.
///
/// ```
/// use stampfly_control::guidance::{Axis, Bounds};
/// let bounds = Bounds { speed: 0.5, acceleration: 1.0, jerk: 5.0 };
/// let mut axis = Axis::at(0.0);
/// let mut seconds = 0.0;
/// while !axis.rests_at(1.0) {
///     axis.step_to(1.0, &bounds, 0.0025);
///     seconds += 0.0025;
///     assert!(axis.velocity < bounds.speed + 1e-3 && axis.position < 1.0 + 1e-3);
/// }
/// assert!(seconds < 2.8, "1 m at 0.5 m/s, plus starting and stopping: {seconds}");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Axis {
    /// Position.
    pub position: f32,
    /// Velocity.
    pub velocity: f32,
    /// Acceleration.
    pub acceleration: f32,
}

impl Axis {
    /// Closer to the goal than this, and slower than [`Self::SLOW`], is there: far below what any vehicle can follow,
    /// far above what single precision can resolve a few hundred metres away from the origin.
    const CLOSE: f32 = 1e-4;
    const SLOW: f32 = 1e-3;

    /// At rest.
    #[must_use]
    pub const fn at(position: f32) -> Self {
        Self { position, velocity: 0.0, acceleration: 0.0 }
    }

    /// One step of `dt` seconds towards a place.
    pub fn step_to(&mut self, goal: f32, bounds: &Bounds, dt: f32) {
        let distance = goal - self.position;
        let settled = self.acceleration.abs() <= bounds.jerk * dt && self.velocity.abs() < Self::SLOW;
        if distance.abs() < Self::CLOSE && settled {
            *self = Self::at(goal);
            return;
        }
        let low = self.reachable(self.towards(-bounds.speed, bounds, dt), bounds, dt);
        let high = self.reachable(self.towards(bounds.speed, bounds, dt), bounds, dt).max(low);
        // How far from the goal a stop would end, seen from the present position: grows with the acceleration.
        let miss = |acceleration: f32| {
            let next = self.moved(acceleration, dt);
            (next.position - self.position) + next.stopping_distance(bounds) - distance
        };
        *self = self.moved(root(miss, low, high), dt);
    }

    /// One step of `dt` seconds towards a velocity.
    pub fn step_at(&mut self, velocity: f32, bounds: &Bounds, dt: f32) {
        let velocity = symmetric(velocity, bounds.speed);
        let reached = (self.velocity - velocity).abs() < Self::SLOW && self.acceleration.abs() <= bounds.jerk * dt;
        *self = if reached {
            Self { position: self.position + velocity * dt, velocity, acceleration: 0.0 }
        } else {
            self.moved(self.reachable(self.towards(velocity, bounds, dt), bounds, dt), dt)
        };
    }

    /// Does the axis rest at this place?
    #[must_use]
    pub fn rests_at(&self, position: f32) -> bool {
        self.position == position && self.rests()
    }

    /// Does the axis rest?
    #[must_use]
    pub fn rests(&self) -> bool {
        self.velocity == 0.0 && self.acceleration == 0.0
    }

    /// How far it would still go if it stopped as fast as the bounds allow; negative is backwards.
    #[must_use]
    pub fn stopping_distance(&self, bounds: &Bounds) -> f32 {
        let Bounds { acceleration: most, jerk, .. } = *bounds;
        // Speed left once the acceleration has been brought to zero decides in which direction to brake.
        let left = self.velocity + self.acceleration * self.acceleration.abs() / (2.0 * jerk);
        let sign = if left < 0.0 { -1.0 } else { 1.0 };
        let (v, a) = (sign * self.velocity, sign * self.acceleration);
        // Peak deceleration: v + a²/2j = p²/j, unless bounded; then some time is spent at the bound.
        let peak = math::larger(math::smaller(math::sqrt(jerk * v + 0.5 * a * a), most), -a);
        let ramp = (a + peak) / jerk;
        let v_peak = v + ramp * (a - 0.5 * jerk * ramp);
        // With no peak to hold there is no time spent at it either.
        let hold = if peak > 1e-6 { math::larger(v_peak / peak - 0.5 * peak / jerk, 0.0) } else { 0.0 };
        let ramp_way = ramp * (v + ramp * (0.5 * a - jerk * ramp / 6.0));
        let hold_way = hold * (v_peak - 0.5 * peak * hold);
        let last_way = peak * peak * peak / (6.0 * jerk * jerk);
        sign * (ramp_way + hold_way + last_way)
    }

    /// The acceleration after this step that leads to a velocity without passing it: it must be possible to bring it
    /// to zero in time, v + (a + a′)dt/2 + a′²/2j = target, solved for a′.
    fn towards(&self, velocity: f32, bounds: &Bounds, dt: f32) -> f32 {
        let missing = velocity - self.velocity - 0.5 * self.acceleration * dt;
        let half = 0.5 * bounds.jerk * dt;
        let full = 2.0 * bounds.jerk * missing.abs();
        // √(h² + f) − h without the cancellation.
        let size = full / (half + math::sqrt(half * half + full));
        if missing < 0.0 { -size } else { size }
    }

    /// The acceleration nearest to the one wanted that is within the bounds and can be reached in this step. An axis
    /// beyond its bounds comes back as fast as jerk allows.
    fn reachable(&self, wanted: f32, bounds: &Bounds, dt: f32) -> f32 {
        let reach = bounds.jerk * dt;
        within(symmetric(wanted, bounds.acceleration), self.acceleration - reach, self.acceleration + reach)
    }

    /// The state after `dt` seconds of constant jerk that ends at this acceleration.
    fn moved(&self, acceleration: f32, dt: f32) -> Self {
        Self {
            position: self.position + dt * (self.velocity + dt * (2.0 * self.acceleration + acceleration) / 6.0),
            velocity: self.velocity + 0.5 * dt * (self.acceleration + acceleration),
            acceleration,
        }
    }
}

/// Where a growing function crosses zero between `low` and `high`, or the end nearest to it.
fn root(function: impl Fn(f32) -> f32, low: f32, high: f32) -> f32 {
    const ENOUGH: f32 = 1e-6;
    let (mut low, mut high) = (low, high);
    let mut above = function(high);
    if above <= 0.0 {
        return high;
    }
    let mut below = function(low);
    if below >= 0.0 {
        return low;
    }
    // Regula falsi; an end that stays where it is for a second time gets half its weight (Illinois).
    let mut last = 0.0f32;
    let mut middle = low;
    for _ in 0..12 {
        middle = (low * above - high * below) / (above - below);
        let value = function(middle);
        if value.abs() < ENOUGH {
            break;
        }
        if value > 0.0 {
            (high, above) = (middle, value);
            if last > 0.0 {
                below *= 0.5;
            }
        } else {
            (low, below) = (middle, value);
            if last < 0.0 {
                above *= 0.5;
            }
        }
        last = value;
    }
    middle
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const DT: f32 = 0.0025;

    prop_compose! {
        fn any_bounds()(speed in 0.05f32..3.0, acceleration in 0.2f32..6.0, jerk in 1f32..60.0) -> Bounds {
            Bounds { speed, acceleration, jerk }
        }
    }

    /// A state of motion that was reached within the bounds.
    fn in_motion(bounds: &Bounds, speeds: &[f32]) -> Axis {
        let mut axis = Axis::at(0.0);
        for speed in speeds {
            for _ in 0..60 {
                axis.step_at(speed * bounds.speed, bounds, DT);
            }
        }
        axis
    }

    fn within(axis: &Axis, before: &Axis, bounds: &Bounds) -> Result<(), TestCaseError> {
        let fine = 1.0 + 1e-3;
        prop_assert!(axis.velocity.abs() <= bounds.speed * fine, "speed {} of {}", axis.velocity, bounds.speed);
        prop_assert!(axis.acceleration.abs() <= bounds.acceleration * fine, "acceleration {}", axis.acceleration);
        let jerk = (axis.acceleration - before.acceleration) / DT;
        prop_assert!(jerk.abs() <= bounds.jerk * fine, "jerk {jerk} of {}", bounds.jerk);
        // And the parts belong together.
        let velocity = before.velocity + 0.5 * DT * (before.acceleration + axis.acceleration);
        prop_assert!((axis.velocity - velocity).abs() <= 1.5e-3);
        Ok(())
    }

    proptest! {
        #[test]
        fn from_rest_it_arrives_in_time_and_never_passes_the_goal(bounds in any_bounds(), goal in -5f32..5.0) {
            let mut axis = Axis::at(0.0);
            let mut seconds = 0.0;
            while !axis.rests_at(goal) {
                let before = axis;
                axis.step_to(goal, &bounds, DT);
                seconds += DT;
                within(&axis, &before, &bounds)?;
                prop_assert!((axis.position * goal.signum()) <= goal.abs() + 5e-4, "passed {goal}: {axis:?}");
                prop_assert!(seconds < 200.0, "never arrives: {axis:?}");
            }
            // Classic double S with all phases present bounds the time from above.
            let ramp = bounds.acceleration / bounds.jerk;
            let bound = goal.abs() / bounds.speed + bounds.speed / bounds.acceleration + ramp;
            let short = 4.0 * math::cbrt(0.5 * goal.abs() / bounds.jerk) + 2.0 * math::sqrt(goal.abs() / bounds.acceleration);
            prop_assert!(seconds <= bound.max(short) * 1.02 + 0.1, "{seconds} s for {bound} or {short}");
        }

        #[test]
        fn goals_may_change_in_any_state_of_motion(
            bounds in any_bounds(),
            speeds in prop::collection::vec(-1f32..1.0, 0..5),
            goals in prop::collection::vec(-3f32..3.0, 1..6),
        ) {
            let mut axis = in_motion(&bounds, &speeds);
            for goal in &goals {
                // Stopping at once would take it here; nothing but the goal may take it further.
                let (mut low, mut high) = (axis.position.min(*goal), axis.position.max(*goal));
                let mut stopping = axis;
                while !stopping.rests() {
                    stopping.step_at(0.0, &bounds, DT);
                    (low, high) = (low.min(stopping.position), high.max(stopping.position));
                }
                for _ in 0..100 {
                    let before = axis;
                    axis.step_to(*goal, &bounds, DT);
                    within(&axis, &before, &bounds)?;
                    prop_assert!((low - 1e-3..=high + 1e-3).contains(&axis.position), "{axis:?} outside {low}..{high}");
                }
            }
            let goal = goals.last().copied().unwrap_or_default();
            let mut steps = 0;
            while !axis.rests_at(goal) && steps < 100_000 {
                axis.step_to(goal, &bounds, DT);
                steps += 1;
            }
            prop_assert!(axis.rests_at(goal), "never arrives: {axis:?}");
        }

        #[test]
        fn speeds_are_reached_without_passing_them(
            bounds in any_bounds(), first in -1f32..1.0, second in -1f32..1.0,
        ) {
            let mut axis = Axis::at(0.0);
            for speed in [first * bounds.speed, second * bounds.speed, 0.0] {
                let from = axis.velocity;
                for _ in 0..20_000 {
                    let before = axis;
                    axis.step_at(speed, &bounds, DT);
                    within(&axis, &before, &bounds)?;
                    let (low, high) = (from.min(speed), from.max(speed));
                    prop_assert!((low - 1e-3..=high + 1e-3).contains(&axis.velocity), "{axis:?} outside {low}..{high}");
                }
                prop_assert_eq!(axis.velocity, speed);
            }
            prop_assert!(axis.rests());
        }

        #[test]
        fn lowered_bounds_are_reached_with_bounded_jerk(bounds in any_bounds(), goal in -3f32..3.0) {
            let mut axis = in_motion(&bounds, &[1.0, 1.0, 1.0]);
            let lower = bounds.scaled(0.3);
            for _ in 0..200_000 {
                let before = axis;
                axis.step_to(goal, &lower, DT);
                prop_assert!((axis.acceleration - before.acceleration).abs() <= lower.jerk * DT * 1.001);
                if axis.rests_at(goal) {
                    break;
                }
            }
            prop_assert!(axis.rests_at(goal), "{axis:?}");
        }

        #[test]
        fn the_stopping_distance_is_where_it_stops(bounds in any_bounds(), speeds in prop::collection::vec(-1f32..1.0, 1..5)) {
            let mut axis = in_motion(&bounds, &speeds);
            let expected = axis.position + axis.stopping_distance(&bounds);
            let fine = DT / 4.0;
            for _ in 0..1_000_000 {
                axis.step_at(0.0, &bounds, fine);
                if axis.rests() {
                    break;
                }
            }
            prop_assert!(axis.rests());
            prop_assert!((axis.position - expected).abs() < 2e-3 + 0.01 * expected.abs(), "{} for {expected}", axis.position);
        }
    }
}
