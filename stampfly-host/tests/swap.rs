//! Another estimator and another controller fly the same mission: the sockets are real.

use stampfly_board::parameters;
use stampfly_host::campaign;
use stampfly_host::simulate::FlightConfig;

/// Flies the reference mission on some seeds with one parameter changed.
fn fly_with(parameter: &str) {
    let configs: Vec<FlightConfig> = (1..=6)
        .map(|seed| {
            let mut config = FlightConfig::reference(seed);
            parameters::set(&mut config.vehicle, parameter, 1.0).expect("a parameter");
            config
        })
        .collect();
    let usual = campaign::run(&[FlightConfig::reference(1)], &|_| {});
    let flights = campaign::run(&configs, &|_| {});
    for flight in &flights {
        assert!(flight.succeeded(), "{parameter}=1, seed {}: {:?}", flight.seed, flight.outcome.metrics);
    }
    assert_ne!(flights[0].outcome.log_hash, usual[0].outcome.log_hash, "{parameter} changes the flight");
}

#[test]
fn the_complementary_filter_flies() {
    fly_with("estimator.type");
}

#[test]
fn the_geometric_controller_flies() {
    fly_with("controller.type");
}
