//! What is a crash and what is none, of two aircraft.

use super::*;
use stampfly_types::{GRAVITY, Quat, Vec3};

/// The Ultra Stick, and one of a quarter of its mass whose tips are higher above wheels that stand
/// closer, with a small motor.
fn aircraft() -> [(f32, CrashConfig); 2] {
    [(9.7, CrashConfig::default()), (5.0, CrashConfig { bank: 0.6, pitch: 0.8, sink: 1.5, current: 24.0 })]
}

/// An aircraft at rest on its wheels.
#[derive(Clone)]
struct Bench {
    estimate: StateEstimate,
    air: AirState,
    power: PowerData,
    place: Place,
    stall: f32,
    config: CrashConfig,
}

impl Bench {
    fn new((stall, config): (f32, CrashConfig)) -> Self {
        let estimate = StateEstimate {
            specific_force: Vec3::new(0.0, 0.0, -GRAVITY),
            valid: Validity::ALL,
            ..StateEstimate::default()
        };
        Self {
            estimate,
            air: AirState::default(),
            power: PowerData::default(),
            place: Place::TaxiingPark,
            stall,
            config,
        }
    }

    /// In the air, level, at one and a half times its stall.
    fn flying(aircraft: (f32, CrashConfig)) -> Self {
        let mut bench = Self { place: Place::CruisingCruise, ..Self::new(aircraft) };
        bench.air.airspeed = 1.5 * bench.stall;
        bench.estimate.velocity = Vec3::new(bench.air.airspeed, 0.0, 0.0);
        bench
    }

    /// Lies as it is turned, at rest.
    fn laid(mut self, attitude: Quat) -> Self {
        self.estimate.attitude = attitude;
        self.estimate.specific_force = attitude.inverse_transform_vector(&Vec3::new(0.0, 0.0, -GRAVITY));
        self
    }

    /// Seconds until it counts as crashed.
    fn crashed(&self) -> Option<f32> {
        let mut crash = Crash::default();
        (0..500).map(|step| step as f32 * 0.02).find(|time| {
            let input = CrashInput {
                estimate: Some(&self.estimate),
                air: &self.air,
                power: Some(&self.power),
                place: self.place,
                stall: self.stall,
                armed: true,
                blow: false,
            };
            crash.step(Instant::from_micros((*time * 1e6) as u64), &input, &self.config)
        })
    }
}

fn rolled(angle: f32) -> Quat {
    Quat::from_axis_angle(&Vec3::x(), angle)
}

fn pitched(angle: f32) -> Quat {
    Quat::from_axis_angle(&Vec3::y(), angle)
}

#[test]
fn on_its_back_its_nose_and_a_wing_tip_it_lies_whatever_it_was_to_do() {
    for aircraft in aircraft() {
        for place in [Place::CruisingCruise, Place::LandingSlope, Place::TaxiingPark, Place::Nowhere] {
            let tip = aircraft.1.bank + 0.08;
            for attitude in [rolled(3.1), rolled(1.4), rolled(-tip), pitched(-1.5), pitched(-1.2) * rolled(0.5)] {
                let after = Bench { place, ..Bench::new(aircraft) }.laid(attitude).crashed().expect("it lies");
                assert!(after < 0.65, "{after} s at {attitude:?} in {place:?}");
            }
            let stands = Bench { place: Place::TaxiingPark, ..Bench::new(aircraft) };
            for attitude in [rolled(0.15), pitched(0.25), pitched(-0.2)] {
                assert_eq!(stands.clone().laid(attitude).crashed(), None, "{attitude:?}");
            }
        }
    }
}

/// A steep turn, a loop and a roll, a slip, a climb, a dive, a start.
#[test]
fn what_an_aeroplane_does_in_the_air_and_on_its_wheels_is_no_crash() {
    for aircraft in aircraft() {
        let felt = |force: [f32; 3], attitude: Quat, rate: f32| {
            let mut bench = Bench::flying(aircraft);
            bench.estimate.attitude = attitude;
            bench.estimate.specific_force = Vec3::from(force) * GRAVITY;
            bench.estimate.angular_rate = Vec3::new(0.0, rate, 0.0);
            bench.crashed()
        };
        assert_eq!(felt([0.0, 0.0, -2.0], rolled(1.05), 0.6), None, "60° of bank");
        assert_eq!(felt([0.0, 0.0, -1.0], rolled(3.1), 1.2), None, "over the top");
        assert_eq!(felt([0.0, 0.0, 1.0], rolled(3.1), 0.0), None, "level flight on its back");
        assert_eq!(felt([0.1, 0.35, -0.9], rolled(0.3), 0.05), None, "a slip");
        assert_eq!(felt([0.55, 0.0, -0.85], pitched(0.6), 0.02), None, "a climb");
        assert_eq!(felt([-0.4, 0.0, -0.5], pitched(-0.9), 0.1), None, "a dive");
        assert_eq!(felt([0.0, 0.0, -0.1], pitched(-0.3), 0.3), None, "over the crest");

        let mut start = Bench { place: Place::TakeOffRoll, ..Bench::new(aircraft) };
        start.estimate.specific_force = Vec3::new(0.8, 0.0, -1.0) * GRAVITY;
        start.estimate.velocity = Vec3::new(4.0, 0.0, 0.0);
        start.power.current = 0.5 * aircraft.1.current;
        assert_eq!(start.crashed(), None, "a start");
        let mut against = Bench { place: Place::TakeOffClimb, ..Bench::flying(aircraft) };
        against.estimate.velocity = Vec3::zeros();
        assert_eq!(against.crashed(), None, "it stands over the ground, against the wind");
    }
}

#[test]
fn a_wing_tip_on_the_ground_is_a_crash_where_wheels_carry_it_and_a_bank_in_the_air_is_none() {
    for aircraft in aircraft() {
        let mut rolls = Bench { place: Place::TakeOffRoll, ..Bench::new(aircraft) };
        rolls.estimate.velocity = Vec3::new(8.0, 0.0, 0.0);
        rolls.estimate.attitude = rolled(-aircraft.1.bank - 0.05);
        // It turns around the tip.
        rolls.estimate.angular_rate = Vec3::new(0.0, 0.0, -1.0);
        assert!(rolls.crashed().is_some_and(|after| after < 0.35));
        let climbs = Bench { place: Place::TakeOffClimb, ..Bench::flying(aircraft) };
        assert_eq!(Bench { estimate: rolls.estimate, ..climbs }.crashed(), None);
    }
}

#[test]
fn a_propeller_that_is_held_and_a_flight_that_stands_are_noticed() {
    for aircraft in aircraft() {
        let mut held = Bench::flying(aircraft);
        held.power.current = 1.1 * aircraft.1.current;
        assert!(held.crashed().is_some_and(|after| after < 0.35));
        let stands = Bench { place: Place::CruisingCruise, ..Bench::new(aircraft) };
        assert!(stands.crashed().is_some_and(|after| (1.9..2.1).contains(&after)));
    }
}

#[test]
fn a_blow_counts_at_once_and_without_an_estimate() {
    let bench = Bench::new(aircraft()[0]);
    let input = CrashInput {
        estimate: None,
        air: &bench.air,
        power: None,
        place: Place::CruisingCruise,
        stall: 9.7,
        armed: true,
        blow: true,
    };
    assert!(Crash::default().step(Instant::ZERO, &input, &bench.config));
    assert!(!Crash::default().step(Instant::ZERO, &CrashInput { blow: false, ..input }, &bench.config));
}
