//! Another estimator and another controller fly the same mission: the sockets are real.

use crate::flown::reference;
use crate::thorough::thorough;
use stampfly_board::simulation::{Setup, StampFly};
use stampfly_host::campaign::{self, Flight};
use stampfly_host::recorder::Recorder;
use stampfly_param::parameters;

/// Flies these, with a hash of each flight.
fn fly(setups: &[(u64, Setup)]) -> Vec<Flight<StampFly, Recorder<StampFly>>> {
    campaign::run(setups, &|_, _| Recorder::<StampFly>::hash_only(), &|_| {})
}

/// Flies the reference mission on some seeds with one parameter changed.
fn fly_with(parameter: &str, value: f32) {
    let setups: Vec<(u64, Setup)> = (1..=thorough(2, 6))
        .map(|seed| {
            let mut setup = Setup::reference(seed);
            parameters::set(&mut setup.vehicle, parameter, value).expect("a parameter");
            (seed, setup)
        })
        .collect();
    let flights = fly(&setups);
    for flight in &flights {
        assert!(flight.succeeded(), "{parameter}={value}, seed {}: {:?}", flight.seed, flight.flown.outcome.metrics);
    }
    assert_ne!(flights[0].witness.hash(), reference(1)[0].hash, "{parameter} changes the flight");
}

#[test]
fn the_complementary_filter_flies() {
    fly_with("estimator.type", 1.0);
}

#[test]
fn the_geometric_controller_flies() {
    fly_with("controller.type", 1.0);
}

#[test]
fn the_incremental_controller_flies() {
    fly_with("controller.type", 2.0);
}
