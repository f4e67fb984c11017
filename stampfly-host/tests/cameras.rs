//! A room with cameras: late poses, some lost, make the position a matter of millimetres.

use stampfly_host::campaign::run;
use stampfly_host::simulate::FlightConfig;

/// Position errors of the estimate on ten seeds, m.
fn errors(cameras: bool) -> Vec<f64> {
    let configs: Vec<_> = (1..=10).map(|seed| FlightConfig { cameras, ..FlightConfig::reference(seed) }).collect();
    let flights = run(&configs, &|_| {});
    assert!(flights.iter().all(|flight| flight.succeeded()));
    flights.iter().map(|flight| flight.outcome.metrics.est_pos_rms_m.expect("it flew")).collect()
}

#[test]
fn late_poses_are_worth_millimetres() {
    for (seed, (seen, alone)) in (1..).zip(errors(true).into_iter().zip(errors(false))) {
        assert!(seen < 0.01 && seen < 0.5 * alone, "seed {seed}: {seen} m with cameras, {alone} m without");
    }
}
