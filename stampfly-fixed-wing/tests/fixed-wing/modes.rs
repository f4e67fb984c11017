//! How modes end otherwise than well, and what follows.

use crate::bench::Bench;
use stampfly_fixed_wing::Config;
use stampfly_fixed_wing::messages::{AirState, CycleStatus, Demand, Home, Lateral, Place, Safety, Thrust, Troubles};
use stampfly_fixed_wing::modes::{Order, PlaneMode};
use stampfly_fixed_wing::path_manager::{PathManager, Sensed, State};
use stampfly_mode::stage::{Duration, Instant};
use stampfly_types::messages::{GuidedCommand, GuidedKind, StateEstimate, Validity};

/// The aircraft as it is for so long: the places it goes through.
fn wait(bench: &mut Bench, seconds: u64) -> Vec<Place> {
    let (mut places, end) = (vec![bench.cycle()], bench.now + Duration::from_secs(seconds));
    while bench.now < end {
        let place = bench.cycle();
        if places.last() != Some(&place) {
            places.push(place);
        }
    }
    places
}

#[test]
fn a_landing_that_floats_or_is_beside_the_strip_goes_round() {
    for floats in [true, false] {
        let mut bench = Bench::new();
        (bench.airspeed, bench.height, bench.position) = (15.0, 40.0, Some([-460.0, 0.0]));
        bench.begin(PlaneMode::Landing);
        bench.fly_to(Place::LandingSlope);
        bench.position = Some([-100.0, 0.0]);
        if floats {
            bench.height = 8.0;
            assert_eq!(bench.cycle(), Place::LandingFlare);
            bench.now += Duration::from_secs(16);
        } else {
            (bench.height, bench.position) = (9.0, Some([-100.0, 12.0]));
        }
        assert_eq!(bench.cycle(), Place::TakeOffClimb, "fast enough, it does not roll");
    }
}

#[test]
fn a_take_off_that_does_not_climb_lands() {
    let mut bench = Bench::new();
    (bench.airspeed, bench.height) = (15.0, 20.0);
    bench.begin(PlaneMode::TakeOff);
    assert_eq!(wait(&mut bench, 59), [Place::TakeOffClimb]);
    assert_eq!(wait(&mut bench, 2), [Place::TakeOffClimb, Place::LandingTransition]);
}

#[test]
fn an_aircraft_that_does_not_move_closes_its_throttle_and_is_parked_when_nobody_wants_it_to_fly() {
    let mut bench = Bench::new();
    bench.begin(PlaneMode::TakeOff);
    assert_eq!(wait(&mut bench, 14), [Place::TakeOffRoll]);
    // It cannot leave the strip either, and tries again after a minute.
    assert_eq!(wait(&mut bench, 59), [Place::TakeOffRoll, Place::TaxiingTurnOff]);
    assert!(bench.demand.thrust == Thrust::Ground && bench.demand.speed < 5.0, "{:?}", bench.demand);
    bench.order = Order::Stand;
    assert_eq!(wait(&mut bench, 300).last(), Some(&Place::TaxiingPark));
    assert_eq!((bench.demand.thrust, bench.demand.throttle, bench.demand.brake), (Thrust::Throttle, 0.0, true));
}

#[test]
fn a_take_off_that_nobody_wants_any_more_is_given_up_on_the_ground_and_not_in_the_air() {
    for (airspeed, wanted) in [(6.0, Place::TaxiingStop), (8.0, Place::TakeOffClimb)] {
        let mut bench = Bench::new();
        bench.begin(PlaneMode::TakeOff);
        assert_eq!(bench.cycle(), Place::TakeOffRoll);
        (bench.airspeed, bench.order) = (airspeed, Order::Stand);
        assert_eq!(bench.cycle(), wanted, "{airspeed} m/s");
    }
}

#[test]
fn a_cruise_that_does_not_know_where_it_is_circles_and_goes_on_when_it_knows() {
    let mut bench = Bench::new();
    (bench.airspeed, bench.height) = (15.0, 50.0);
    bench.begin(PlaneMode::Cruising);
    assert_eq!(bench.cycle(), Place::CruisingCruise);
    (bench.position, bench.order) = (None, Order::Land);
    assert_eq!(wait(&mut bench, 30), [Place::CruisingCruise], "nor can it land");
    let Demand { lateral, bank, height, .. } = bench.demand;
    assert_eq!((lateral, height), (Lateral::Bank, 50.0));
    assert!(bank != 0.0);
    bench.position = Some([0.0; 2]);
    assert_eq!(bench.cycle(), Place::LandingTransition);
}

#[test]
fn a_landing_that_does_not_know_where_it_is_goes_round() {
    let mut bench = Bench::new();
    (bench.airspeed, bench.height, bench.position) = (15.0, 40.0, Some([-460.0, 0.0]));
    bench.begin(PlaneMode::Landing);
    bench.fly_to(Place::LandingSlope);
    bench.position = None;
    assert_eq!(bench.cycle(), Place::TakeOffClimb);
}

#[test]
fn a_path_manager_without_an_attitude_glides_for_good_and_no_mode_is_asked() {
    let valid = [Validity::TILT, Validity::VELOCITY_Z, Validity::POSITION_Z, Validity::POSITION_XY, Validity::HEADING];
    let estimate = StateEstimate { valid: valid.into_iter().fold(Validity::NONE, |a, b| a | b), ..Default::default() };
    let orders = [GuidedKind::Arm, GuidedKind::TakeOff].map(|kind| [GuidedCommand { kind, ..Default::default() }]);
    let mut manager = PathManager::default();
    let mut cycle = |milliseconds, troubles, commands: &[GuidedCommand]| {
        let sensed = Sensed {
            estimate: &estimate,
            air: &AirState::default(),
            home: &Home { latitude: 434_700_000, longitude: -805_400_000, altitude: 0, known: true },
            safety: &Safety { troubles, ..Safety::default() },
            config: &Config::default(),
            commands,
            edits: &[],
        };
        let demand = manager.cycle(Instant::from_millis(milliseconds), &sensed);
        (demand.throttle, manager.state(), manager.status().cycle, manager.status().place)
    };
    let [arm, take_off] = &orders;
    let well = |throttle, place| (throttle, State::CommsWithAttitude, CycleStatus::CompletedCycle, place);
    assert_eq!(cycle(20, Troubles::NONE, arm), well(0.0, Place::TaxiingPark));
    assert_eq!(cycle(40, Troubles::NONE, take_off), well(1.0, Place::TakeOffRoll));
    let failed = (0.0, State::FatalFailure, CycleStatus::FailureMode, Place::TakeOffRoll);
    assert_eq!(cycle(60, Troubles::ATTITUDE, &[]), failed);
    // Neither the end of the trouble nor a command brings it back.
    assert_eq!(cycle(80, Troubles::NONE, take_off), failed);
}
