//! Does the vehicle stand? Thrust is taken away; if the accelerometer does not notice, something else carries the weight.
//!
//! In the air the accelerometer measures thrust over mass, so a share less of thrust is the same share less of specific
//! force within the motors' lag. On the ground the legs take over what the rotors leave, and the specific force stays one g.
//! Neither mass nor height nor climb rate is needed, and a constant bias of the accelerometer cancels: both quantities are
//! compared with what they were before.
//!
//! The test costs height: with 40 % of the thrust missing, a vehicle in the air has gained 0.2 m/s after 60 ms.

use stampfly_types::Instant;

/// What the test says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Support {
    /// Not enough thrust has been taken away to tell.
    Unknown,
    /// Something other than the rotors carries the vehicle.
    Stands,
    /// Nothing does.
    Falls,
}

/// Motors' lag, s: 20 ms on small ones.
const LAG: f32 = 0.02;
/// Time constant of the quick answer, s: before a vehicle in the air has become fast.
const QUICK: f32 = 0.02;
/// Time constant of the steady answer, s: a bent propeller's beat, some hertz and a third of a g, is averaged out.
const STEADY: f32 = 0.15;
/// Less than this share of the thrust taken away tells nothing: vibration leaves 0.05 g in the mean over [`QUICK`].
const LEAST_SHARE: f32 = 0.15;
/// The specific force follows thrust by less than this: it stands. Legs that spring back follow for a moment.
const STANDS: f32 = 0.4;
/// By more than this: it falls. The air carries the rest, a fifth by its cushion near the ground, more by drag with speed.
const FALLS: f32 = 0.5;
/// So much more specific force for its thrust has a vehicle that drag brakes; one that stands with little thrust has more.
const CARRIED: f32 = 1.3;
/// A step that lasts longer is treated as this long, s.
const LONGEST_STEP: f32 = 0.02;

/// Specific force upwards along the body's z axis, m/s², and thrust, N, through the same filter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Pair {
    force: f32,
    thrust: f32,
}

impl Pair {
    fn filter(&mut self, input: Self, time: f32, dt: f32) {
        let share = dt / (time + dt);
        self.force += share * (input.force - self.force);
        self.thrust += share * (input.thrust - self.thrust);
    }

    /// What this says, compared with what both were before.
    fn support(self, before: Self) -> Support {
        // Positive: both were there before.
        if !(before.thrust > 0.0 && before.force > 0.0) {
            return Support::Unknown;
        }
        let taken = 1.0 - self.thrust / before.thrust;
        let missing = 1.0 - self.force / before.force;
        if taken < LEAST_SHARE {
            Support::Unknown
        } else if missing < STANDS * taken {
            Support::Stands
        } else if missing > FALLS * taken {
            Support::Falls
        } else {
            Support::Unknown
        }
    }
}

/// Two answers to the same question.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answers {
    /// Within 60 ms of thrust being taken away.
    pub quick: Support,
    /// Within half a second, through strong vibration.
    pub steady: Support,
}

const UNKNOWN: Answers = Answers { quick: Support::Unknown, steady: Support::Unknown };

/// Filtered thrust and specific force, and what both were before thrust was taken away.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WeightTest {
    last: Option<Instant>,
    /// Thrust as the motors deliver it, N.
    delivered: f32,
    quick: Pair,
    steady: Pair,
    before: Pair,
}

impl WeightTest {
    /// Takes one step's specific force upwards, m/s², and demanded thrust, N. `testing`: thrust is being taken away, the
    /// reference stays.
    pub fn step(&mut self, now: Instant, force: f32, thrust: f32, testing: bool) -> Answers {
        if !(force.is_finite() && thrust.is_finite()) {
            return UNKNOWN;
        }
        let Some(last) = self.last.replace(now) else {
            let first = Pair { force, thrust };
            (self.delivered, self.quick, self.steady, self.before) = (thrust, first, first, first);
            return UNKNOWN;
        };
        let dt = now.since(last).seconds().min(LONGEST_STEP);
        self.delivered += dt / (LAG + dt) * (thrust - self.delivered);
        let input = Pair { force, thrust: self.delivered };
        self.quick.filter(input, QUICK, dt);
        self.steady.filter(input, STEADY, dt);
        // What carries itself keeps its ratio of specific force to thrust. What stands does not, and tells nothing of before.
        let carried = self.steady.force * self.before.thrust <= CARRIED * self.before.force * self.steady.thrust;
        if !testing && carried {
            self.before = self.steady;
            return UNKNOWN;
        }
        Answers { quick: self.quick.support(self.before), steady: self.steady.support(self.before) }
    }
}
