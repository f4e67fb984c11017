//! Does the vehicle stand? Thrust is taken away; if the accelerometer does not notice, something else carries the weight.
//!
//! In the air the accelerometer measures thrust over mass, so a share less of thrust is the same share less of specific
//! force within the motors' lag. On the ground the legs take over what the rotors leave, and the specific force stays one g.
//! Neither mass nor height nor climb rate is needed, and a constant bias of the accelerometer cancels: both quantities are
//! compared with what they were before.
//!
//! The test costs height: with 40 % of the thrust missing, a vehicle in the air has gained 0.2 m/s after 60 ms.

use stampfly_types::Instant;
use stampfly_types::math::smaller;

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
/// So much more specific force than its thrust makes, over [`QUICK`], is a blow: it stops 0.1 m/s within 10 ms. Vibration leaves a
/// twentieth.
const STRUCK: f32 = 1.4;
/// So much more specific force for its thrust has a vehicle that drag brakes; one that stands with little thrust has more.
const CARRIED: f32 = 1.3;
/// Shares of the thrust and of the specific force of the flight.
pub(super) const LITTLE_THRUST: f32 = 0.55;
pub(super) const ALL_FORCE: f32 = 0.9;
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

/// Two answers to the same question, and what else the two quantities say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answers {
    /// Within 60 ms of thrust being taken away.
    pub quick: Support,
    /// Within half a second, through strong vibration.
    pub steady: Support,
    /// Half of the thrust of the flight is gone, and the specific force is still that of the flight: nothing that flies does
    /// this, at less than 2.5 m/s downwards, however slowly the thrust went.
    pub is_carried: bool,
    /// Something pushed it up harder than its thrust: it has touched down, at more than about 0.1 m/s.
    pub is_struck: bool,
    /// Mean of the delivered thrust over [`STEADY`], N; zero in the first step.
    pub thrust: f32,
    /// The same of the specific force upwards, m/s².
    pub force: f32,
}

impl Answers {
    /// Nothing is known.
    pub const UNKNOWN: Self = Self {
        quick: Support::Unknown,
        steady: Support::Unknown,
        is_carried: false,
        is_struck: false,
        thrust: 0.0,
        force: 0.0,
    };
}

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
    /// Both when the landing began.
    flight: Pair,
}

impl WeightTest {
    /// A landing begins.
    pub fn begin_landing(&mut self) {
        self.flight = self.steady;
    }

    /// Takes one step's specific force upwards, m/s², and thrust that the motors were told to make,
    /// N. `testing`: thrust is being taken away, the reference stays.
    pub fn step(&mut self, now: Instant, force: f32, thrust: f32, testing: bool) -> Answers {
        let unknown = Answers::UNKNOWN;
        if !(force.is_finite() && thrust.is_finite()) {
            return unknown;
        }
        let Some(last) = self.last.replace(now) else {
            let first = Pair { force, thrust };
            (self.delivered, self.quick, self.steady, self.before) = (thrust, first, first, first);
            return unknown;
        };
        let dt = smaller(now.since(last).seconds(), LONGEST_STEP);
        self.delivered += dt / (LAG + dt) * (thrust - self.delivered);
        let input = Pair { force, thrust: self.delivered };
        self.quick.filter(input, QUICK, dt);
        self.steady.filter(input, STEADY, dt);
        let Pair { force, thrust } = self.steady;
        // What carries itself keeps its ratio of specific force to thrust. What stands does not, and tells nothing of before.
        let is_carried = self.steady.thrust < LITTLE_THRUST * self.flight.thrust
            && self.steady.force > ALL_FORCE * self.flight.force;
        let keeps_ratio = self.steady.force * self.before.thrust <= CARRIED * self.before.force * self.steady.thrust;
        // More thrust than before a test that begins while motors spool up is none that was taken away.
        let taken = self.steady.thrust < self.before.thrust;
        if keeps_ratio && !(testing && taken) {
            self.before = self.steady;
            return Answers { is_carried, thrust, force, ..unknown };
        }
        let is_struck = self.quick.force * self.before.thrust > STRUCK * self.before.force * self.quick.thrust;
        let [quick, steady] = [self.quick, self.steady].map(|pair| pair.support(self.before));
        Answers { quick, steady, is_carried, is_struck, thrust, force }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stampfly_types::GRAVITY;

    /// A take-off is given up a tenth of a second after its motors started: thrust went on rising when the test began.
    #[test]
    fn a_vehicle_that_never_left_the_ground_stands() {
        let mut test = WeightTest::default();
        let mut stands = false;
        for step in 0u64..800 {
            let thrust = match step {
                0..40 => 0.0,
                40..80 => 0.43,
                _ => (0.36 - 0.0006 * (step - 80) as f32).max(0.18),
            };
            let answers = test.step(Instant::from_micros(2_500 * step), GRAVITY, thrust, step > 80);
            stands = answers.steady == Support::Stands;
        }
        assert!(stands);
    }

    /// Hover thrusts of vehicles of 4 g, 40 g and 400 g, N.
    const SIZES: [f32; 3] = [0.036, 0.36, 3.6];

    /// Hovers, sinks under a ceiling, and is pushed up by so much, m/s², for 10 ms.
    fn is_struck(hover: f32, push: f32) -> bool {
        let mut test = WeightTest::default();
        (0u64..500).any(|step| {
            let thrust = if step < 400 { hover } else { 0.92 * hover };
            let push = if (450..454).contains(&step) { push } else { 0.0 };
            let force = GRAVITY * thrust / hover + push;
            test.step(Instant::from_micros(2_500 * step), force, thrust, step >= 400).is_struck
        })
    }

    #[test]
    fn a_touch_at_a_fifth_of_a_metre_per_second_is_felt_and_vibration_is_not() {
        for hover in SIZES {
            assert!(is_struck(hover, 20.0), "{hover} N");
            assert!(!is_struck(hover, 5.0), "{hover} N");
        }
    }

    /// What it was before thrust was taken away is remembered for as long as the force does not follow.
    #[test]
    fn what_a_test_has_found_standing_stands_after_it() {
        for hover in SIZES {
            let support = |follows: bool| {
                let mut test = WeightTest::default();
                let mut answers = None;
                for step in 0u64..1_200 {
                    let share = 1.0 - 0.45 * (step.saturating_sub(400).min(400) as f32 / 400.0);
                    let force = GRAVITY * if follows { share } else { 1.0 };
                    answers = Some(test.step(Instant::from_micros(2_500 * step), force, share * hover, step < 800));
                }
                answers.map(|answers| answers.steady)
            };
            assert_eq!(support(false), Some(Support::Stands), "{hover} N");
            assert_eq!(support(true), Some(Support::Unknown), "{hover} N, in the air");
        }
    }

    /// Flies, and lands with this thrust at the end of a second and this share of the specific force that thrust makes.
    fn is_carried(thrust: f32, force: f32) -> bool {
        is_carried_with(thrust, force, 2_500, None)
    }

    /// The same with steps of so many microseconds, and with this sample in flight.
    fn is_carried_with(thrust: f32, force: f32, micros: u64, broken: Option<(f32, f32)>) -> bool {
        let mut test = WeightTest::default();
        let mut answers = None;
        let second = 1_000_000 / micros;
        for step in 0..4 * second {
            let gone = step.saturating_sub(second).min(second) as f32 / second as f32;
            let [thrust, force] = [(0.36, thrust), (GRAVITY, force)].map(|(from, to)| from + (to - from) * gone);
            if step == second {
                test.begin_landing();
            }
            let (force, thrust) = broken.filter(|_| step == second / 4).unwrap_or((force, thrust));
            answers = Some(test.step(Instant::from_micros(micros * step), force, thrust, false));
        }
        answers.is_some_and(|answers| answers.is_carried)
    }

    #[test]
    fn a_sample_that_is_no_number_and_long_steps_blind_nobody() {
        for broken in [(f32::NAN, 0.36), (GRAVITY, f32::NAN), (f32::INFINITY, 0.36), (GRAVITY, f32::INFINITY)] {
            assert!(is_carried_with(0.18, GRAVITY, 2_500, Some(broken)), "{broken:?}");
        }
        for micros in [10_000, 20_000, 50_000] {
            assert!(is_carried_with(0.18, GRAVITY, micros, None), "{micros} microseconds");
            assert!(!is_carried_with(0.34, GRAVITY, micros, None), "{micros} microseconds");
        }
    }

    #[test]
    fn what_the_ground_carries_is_noticed_however_slowly_its_thrust_went() {
        assert!(is_carried(0.18, GRAVITY));
        assert!(!is_carried(0.34, GRAVITY), "at its rate of descent");
        assert!(!is_carried(0.18, 0.5 * GRAVITY + 1.4), "it falls, with 1 m/s of drag");
        assert!(!is_carried(0.18, 0.5 * GRAVITY + 1.4 * 2.0), "with 2 m/s");
    }

    #[test]
    fn without_numbers_or_a_flight_before_nothing_is_known() {
        let mut test = WeightTest::default();
        for broken in [f32::NAN, f32::INFINITY] {
            for (force, thrust) in [(broken, 0.3), (GRAVITY, broken)] {
                let answers = test.step(Instant::ZERO, force, thrust, true);
                assert_eq!((answers.quick, answers.steady), (Support::Unknown, Support::Unknown));
                assert!(!answers.is_carried && !answers.is_struck);
            }
        }
        // Nothing that carries, or a force that points down, before the test: a share of that is none.
        for (force, thrust) in [(0.0, 0.0), (-1.0, 0.3)] {
            let mut test = WeightTest::default();
            for step in 0u64..200 {
                let answers = test.step(Instant::from_micros(2_500 * step), force, thrust, step > 80);
                assert_eq!((answers.quick, answers.steady), (Support::Unknown, Support::Unknown), "{force} {thrust}");
            }
        }
    }

    #[test]
    fn support_is_what_the_force_makes_of_the_thrust_that_was_taken_away() {
        let before = Pair { force: 8.0, thrust: 0.4 };
        // Shares that are missing of thrust and force.
        for (taken, missing, expected) in [
            (0.14, 0.0, Support::Unknown),
            (0.16, 0.0, Support::Stands),
            (0.2, 0.07, Support::Stands),
            (0.2, 0.09, Support::Unknown),
            (0.2, 0.11, Support::Falls),
            (0.2, 0.6, Support::Falls),
            (0.5, 0.18, Support::Stands),
            (0.5, 0.22, Support::Unknown),
            (0.5, 0.27, Support::Falls),
        ] {
            let now = Pair { force: before.force * (1.0 - missing), thrust: before.thrust * (1.0 - taken) };
            assert_eq!(now.support(before), expected, "{taken} taken, {missing} missing");
        }
    }

    /// A share of nothing, or of a force that points down, is none.
    #[test]
    fn without_a_thrust_and_a_force_before_support_is_unknown() {
        let now = Pair { force: -1.0, thrust: 0.2 };
        for before in [(-1.0, 0.4), (0.0, 0.4), (8.0, 0.0), (8.0, -0.4), (0.0, 0.0)] {
            for force in [-1.0, 1.0] {
                let before = Pair { force: before.0, thrust: before.1 };
                assert_eq!(Pair { force, ..now }.support(before), Support::Unknown, "{before:?}");
            }
        }
    }

    #[test]
    fn both_go_through_the_same_filter() {
        let mut pair = Pair { force: 8.0, thrust: 0.4 };
        for part in [0.75, 0.5625] {
            pair.filter(Pair { force: 4.0, thrust: 0.8 }, 0.15, 0.05);
            assert!((pair.force - (4.0 + 4.0 * part)).abs() < 1e-5, "{pair:?}");
            assert!((pair.thrust - (0.8 - 0.4 * part)).abs() < 1e-6, "{pair:?}");
        }
    }
}
