//! From a demand and a state to surfaces and throttle, at the control rate: the loops of this module put together.
//!
//! Use it for a conventional aeroplane; which servo moves which surface is the vehicle's matter. Set-points change no faster than an aircraft of this size follows, and before it is too slow the nose comes down,
//! whatever is wanted. Not for a pilot's sticks.

use super::demand::{Demand, Lateral, Thrust, Vertical};
use super::energy::{Energy, EnergyConfig, EnergyDemand, EnergyInput};
use super::loops::{Wing, WingConfig, WingDemand, WingLoops};
use super::track::{Steering, TrackConfig};
use crate::bound::{symmetric, within};
use crate::surfaces::SurfaceDemand;
use stampfly_types::messages::{AirState, StateEstimate};
use stampfly_types::{GRAVITY, frame, math};

/// How fast set-points change: bank and pitch, rad/s, and throttle, 1/s.
const BANK_RATE: f32 = 1.2;
const PITCH_RATE: f32 = 0.5;
const THROTTLE_RATE: f32 = 1.5;
/// Slower than this over the ground, m/s, the course is the nose's.
const MOVES: f32 = 2.0;
/// Largest bank that is flown without a path, rad.
const BANK_MAX: f32 = 0.6;
/// In a climb at a given pitch the nose comes down by so much for each m/s that it is too slow, rad·s/m.
const SAVES: f32 = 0.08;
/// Throttle for a missing m/s, in such a climb and on wheels; and what turns the wheels at all.
const SPEEDS: f32 = 0.15;
const ROLLS: f32 = 0.1;

/// Gains and limits of [`Autopilot`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AutopilotConfig {
    /// Paths. The largest bank is the demand's.
    pub track: TrackConfig,
    /// Height and speed. `speed_min` also guards a climb at a given pitch.
    pub energy: EnergyConfig,
    /// Surfaces.
    pub wing: WingConfig,
}

/// What it does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Flown {
    /// What the surfaces are asked for.
    pub surfaces: SurfaceDemand,
    /// Share of full throttle.
    pub throttle: f32,
}

/// The autopilot.
///
/// ```
/// use stampfly_control::fixed_wing::{Autopilot, AutopilotConfig, Demand, Track};
/// use stampfly_types::{Vec3, messages::{AirState, StateEstimate}};
/// let air = AirState { airspeed: 15.0, indicated: 15.0, measured: true, ..Default::default() };
/// let level = StateEstimate { velocity: Vec3::new(15.0, 0.0, 0.0), position: Vec3::new(0.0, 30.0, -50.0), ..Default::default() };
/// let north = Demand::track(Track::Line { through: [0.0, 0.0], course: 0.0 }, 0.6).at(60.0, 0.0).fast(15.0);
/// let mut autopilot = Autopilot::default();
/// let flown = autopilot.step(0.0025, &north, &level, &air, &AutopilotConfig::default());
/// assert!(flown.surfaces.roll < 0.0 && flown.surfaces.pitch > 0.0, "back to the left, and up");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Autopilot {
    energy: Energy,
    loops: WingLoops,
    /// Set-points of the last step.
    bank: f32,
    pitch: f32,
    throttle: f32,
    was_on_ground: bool,
}

impl Autopilot {
    /// One step of `dt` seconds.
    pub fn step(
        &mut self,
        dt: f32,
        demand: &Demand,
        estimate: &StateEstimate,
        air: &AirState,
        config: &AutopilotConfig,
    ) -> Flown {
        let [roll, pitch, heading] = frame::roll_pitch_yaw(&estimate.attitude);
        let [north, east, down] = estimate.velocity.to_array();
        let ground_speed = math::sqrt(north * north + east * east);
        let course = if ground_speed > MOVES { math::atan2(east, north) } else { heading };
        if demand.on_ground && !self.was_on_ground {
            self.energy.reset();
        }
        self.was_on_ground = demand.on_ground;

        let paths = TrackConfig { bank_max: demand.bank_max, ..config.track };
        let [x, y, _] = estimate.position.to_array();
        let steering = demand.path().map(|track| track.steer([x, y], [north, east], &paths));
        let bank = match (&steering, demand.lateral) {
            _ if demand.on_ground => 0.0,
            (Some(steering), _) => steering.bank(course, ground_speed, &paths),
            (None, Lateral::Bank) => symmetric(demand.bank, BANK_MAX),
            (None, _) => Steering::to(demand.course).bank(course, ground_speed, &paths),
        };
        self.bank = towards(self.bank, bank, BANK_RATE * dt);

        let input = EnergyInput {
            height: -estimate.position.z,
            climb: -down,
            airspeed: air.airspeed,
            // Along the nose, without what gravity is there.
            acceleration: estimate.specific_force.x - GRAVITY * math::sin(pitch),
            bank: roll,
        };
        let wanted = EnergyDemand {
            height: if demand.vertical == Vertical::Height { demand.height } else { input.height },
            climb: demand.climb,
            airspeed: if demand.thrust == Thrust::Airspeed { demand.speed } else { air.airspeed },
            height_alone: demand.vertical == Vertical::Climb,
        };
        let energy = &config.energy;
        let output = if demand.on_ground { Default::default() } else { self.energy.step(dt, &input, &wanted, energy) };
        let slow = (energy.speed_min - air.airspeed).max(0.0);
        let nose = match demand.vertical {
            Vertical::Pitch if demand.on_ground => demand.pitch,
            Vertical::Pitch => demand.pitch - SAVES * slow,
            Vertical::Height | Vertical::Climb => output.pitch,
        };
        self.pitch = towards(self.pitch, nose, PITCH_RATE * dt);
        let throttle = match (demand.thrust, demand.vertical) {
            (Thrust::Throttle, _) => demand.throttle,
            (Thrust::Ground, _) => ROLLS + SPEEDS * (demand.speed - ground_speed),
            // What the climb takes, and more when it is slow.
            (Thrust::Airspeed, Vertical::Pitch) => {
                let climb = energy.throttle_feed * math::sin(demand.pitch);
                energy.throttle_trim + climb + SPEEDS * (demand.speed - air.airspeed)
            }
            (Thrust::Airspeed, _) => output.throttle,
        };
        self.throttle = towards(self.throttle, within(throttle, 0.0, 1.0), THROTTLE_RATE * dt);

        let held = match (demand.lateral, &steering) {
            // On wheels a line is steered by the nose.
            (Lateral::Line, Some(steering)) if demand.on_ground => Some(steering.course),
            _ if demand.aligned || demand.lateral == Lateral::Heading => Some(demand.course),
            _ => None,
        };
        let wing = Wing {
            attitude: [roll, pitch, heading],
            rate: estimate.angular_rate,
            side_force: estimate.specific_force.y,
            airspeed: if demand.on_ground { ground_speed.max(air.indicated) } else { air.indicated },
        };
        let goal = WingDemand { bank: self.bank, pitch: self.pitch, heading: held, on_ground: demand.on_ground };
        let surfaces = self.loops.step(dt, &wing, &goal, &config.wing);
        Flown { surfaces, throttle: self.throttle }
    }
}

/// Towards a set-point, by `most` at most. What is no number changes nothing.
fn towards(from: f32, to: f32, most: f32) -> f32 {
    let next = from + symmetric(to - from, most.max(0.0));
    if next.is_finite() { next } else { from }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use stampfly_types::Vec3;

    const AIR: AirState = AirState { airspeed: 15.0, indicated: 15.0, wind: [0.0; 2], wind_sigma: 1.0, measured: true };

    fn settled(demand: &Demand, estimate: &StateEstimate, air: &AirState) -> (Flown, Autopilot) {
        let (mut autopilot, config) = (Autopilot::default(), AutopilotConfig::default());
        let mut flown = Flown::default();
        for _ in 0..400 {
            flown = autopilot.step(0.0025, demand, estimate, air, &config);
        }
        (flown, autopilot)
    }

    #[test]
    fn wheels_are_steered_by_the_rudder_and_wings_stay_level() {
        let standing = StateEstimate { position: Vec3::new(0.0, 4.0, 0.0), ..Default::default() };
        let line = Demand::track(super::super::Track::Line { through: [0.0; 2], course: 0.0 }, 0.6).rolling(2.0, 0.0);
        let (flown, _) = settled(&line, &standing, &AirState::default());
        assert!(flown.surfaces.yaw < -0.01 && flown.surfaces.roll == 0.0, "{flown:?}");
        assert!((flown.throttle - 0.4).abs() < 1e-3);
    }

    #[test]
    fn a_climb_at_a_given_pitch_lowers_its_nose_before_it_is_too_slow() {
        let level = StateEstimate { velocity: Vec3::new(8.0, 0.0, 0.0), ..Default::default() };
        let climb = Demand { vertical: Vertical::Pitch, pitch: 0.3, ..Demand::nose(0.0) }.fast(15.0);
        let slow = AirState { airspeed: 7.0, indicated: 7.0, ..AIR };
        let [steep, saved] = [AIR, slow].map(|air| settled(&climb, &level, &air).1);
        assert!((steep.pitch - 0.3).abs() < 1e-6 && (saved.pitch - 0.14).abs() < 1e-6, "{steep:?} {saved:?}");
        assert_eq!(saved.throttle, 1.0);
    }

    proptest! {
        #[test]
        fn any_numbers_give_surfaces_and_a_throttle(
            numbers: [f32; 9], vector: [f32; 3], lateral in 0u32..4, vertical in 0u32..3, thrust in 0u32..3, flags: [bool; 3],
        ) {
            let [north, east, course, radius, height, climb, pitch, speed, throttle] = numbers;
            let of = |kinds: [Lateral; 4]| kinds[lateral as usize];
            let demand = Demand {
                lateral: of([Lateral::Bank, Lateral::Line, Lateral::Orbit, Lateral::Heading]),
                place: [north, east],
                course,
                radius,
                bank: course,
                bank_max: pitch,
                aligned: flags[0],
                vertical: [Vertical::Pitch, Vertical::Height, Vertical::Climb][vertical as usize],
                height,
                climb,
                pitch,
                thrust: [Thrust::Throttle, Thrust::Airspeed, Thrust::Ground][thrust as usize],
                speed,
                throttle,
                on_ground: flags[1],
                brake: flags[2],
            };
            let state = StateEstimate { position: Vec3::from(vector), velocity: Vec3::from(vector), ..Default::default() };
            let mut autopilot = Autopilot::default();
            for _ in 0..3 {
                let flown = autopilot.step(0.0025, &demand, &state, &AIR, &AutopilotConfig::default());
                prop_assert!((0.0..=1.0).contains(&flown.throttle), "{flown:?}");
                let SurfaceDemand { roll, pitch, yaw, .. } = flown.surfaces;
                prop_assert!([roll, pitch, yaw].iter().all(|part| part.abs() <= 1.0), "{flown:?}");
            }
        }
    }
}
