//! A room with cameras: late poses, some lost, make the position a matter of millimetres.

use stampfly_board::simulation::{Setup, StampFly};
use stampfly_host::campaign::run;

/// Position errors of the estimate on ten seeds, m.
fn errors(cameras: bool) -> Vec<f64> {
    let setups: Vec<_> = (1..=10).map(|seed| (seed, Setup { cameras, ..Setup::reference(seed) })).collect();
    let flights = run::<StampFly, ()>(&setups, &|_, _| (), &|_| {});
    assert!(flights.iter().all(|flight| flight.succeeded()));
    flights.iter().map(|flight| flight.flown.outcome.metrics.est_pos_rms_m.expect("it flew")).collect()
}

#[test]
fn late_poses_are_worth_millimetres() {
    for (seed, (seen, alone)) in (1..).zip(errors(true).into_iter().zip(errors(false))) {
        assert!(seen < 0.01 && seen < 0.5 * alone, "seed {seed}: {seen} m with cameras, {alone} m without");
    }
}
